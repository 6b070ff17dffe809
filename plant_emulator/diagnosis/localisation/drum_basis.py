"""Unknown laws of the drum's side: a torque on the drum, its speed sensor, gap and shaft."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.linear_splines import hats, of_time
from plant_emulator.diagnosis.localisation.parity_relations import NOISES, Measured, turned
from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

# Window of the speed that laws depend on, and step of laws of time [s].
WINDOW, SLOW = 0.3, 2.0
# Unit of the unknown torque [N m]; of the sensor's error, in its noise.
TORQUE, ERROR = 10.0, 0.1
# Speed at which friction counts as one of motion [rad/s at the drum].
MOVING = 0.05


def torque(m: Measured, ratio: float, largest: float) -> Array:
    """A torque on the drum by its speed and by its angle, shape (n, 6) [N m].

    largest : speed of the motor in all runs [rad/s]
    """
    speed, angle = smooth(m.time, m.speed, WINDOW) / ratio, turned(m.time, m.drum_speed)
    moving = np.tanh(speed / MOVING)[:, None]
    by_speed = -moving * hats(np.abs(speed), np.linspace(0.0, largest / ratio, 4))
    return np.asarray(TORQUE * np.column_stack([by_speed, np.sin(angle), np.cos(angle)]))


def speed_sensor(m: Measured, ratio: float) -> tuple[Array, Array, Array]:
    """Errors of the measuring wheel by speed, by acceleration, by time, over its noise."""
    level = m.noise[NOISES.index("drum_speed")] / ERROR
    speed, rate, bend = (smooth(m.time, m.speed / ratio, WINDOW, k) for k in range(3))
    by_speed = speed[:, None] * hats(np.abs(speed), np.linspace(0.0, 8.0, 5))
    by_rate = np.stack([rate, np.abs(rate), bend / 10.0, rate * speed], -1)
    return by_speed / level, by_rate / level, of_time(m.time, SLOW) / level


def backlash(m: Measured, slopes: Array) -> tuple[Array, Array]:
    """Gap and damping of their own at every contact.

    slopes : of the drum's speed over its noise, the gap's and the damping's first, shape (n, k)
    """
    pieces = of_time(m.time, SLOW)
    return pieces * slopes[:, [0]], pieces * slopes[:, [1]]
