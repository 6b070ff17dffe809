"""Unknown laws of the drum's subsystem: a torque on the drum, its speed sensor, gap and shaft."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.linear_splines import linear_splines, time_splines
from plant_emulator.diagnosis.localisation.measured_signals import (
    NOISES,
    MeasuredSignals,
    turned_angle,
)
from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

# Smoothing window of the speed that laws depend on, and step of laws of time [s].
SPEED_WINDOW, TIME_STEP = 0.3, 2.0
# Unit of the unknown torque [N m], and of the sensor's error [its noise].
DRUM_TORQUE_UNIT, ERROR_UNIT = 10.0, 0.1
# Speed at which friction counts as one of motion [rad/s at the drum].
FRICTION_SPEED = 0.05


def torque(m: MeasuredSignals, ratio: float, largest: float) -> Array:
    """Basis of an unknown torque on the drum, by its speed and its angle [N m], shape (n, 6).

    ratio : of the gear; largest : motor speed of all runs [rad/s]
    """
    speed, angle = smooth(m.time, m.speed, SPEED_WINDOW) / ratio, turned_angle(m.time, m.drum_speed)
    moving = np.tanh(speed / FRICTION_SPEED)[:, None]
    by_speed = -moving * linear_splines(np.abs(speed), np.linspace(0.0, largest / ratio, 4))
    return np.asarray(DRUM_TORQUE_UNIT * np.column_stack([by_speed, np.sin(angle), np.cos(angle)]))


def speed_sensor(m: MeasuredSignals, ratio: float) -> tuple[Array, Array, Array]:
    """Errors of the drum's speed sensor over its noise [1]: by speed, by acceleration, by time.

    ratio : of the gear; each basis has the shape (n, k)
    """
    level = m.noise[NOISES.index("drum_speed")] / ERROR_UNIT
    speed, rate, bend = (smooth(m.time, m.speed / ratio, SPEED_WINDOW, k) for k in range(3))
    by_speed = speed[:, None] * linear_splines(np.abs(speed), np.linspace(0.0, 8.0, 5))
    by_rate = np.stack([rate, np.abs(rate), bend / 10.0, rate * speed], -1)
    return by_speed / level, by_rate / level, time_splines(m.time, TIME_STEP) / level


def backlash(m: MeasuredSignals, slopes: Array) -> tuple[Array, Array]:
    """Gap and damping that change in time, as changes of the drum speed over its noise [1].

    slopes : derivatives of the drum speed over its noise, by gap and damping first, shape (n, k)
    """
    pieces = time_splines(m.time, TIME_STEP)
    return pieces * slopes[:, [0]], pieces * slopes[:, [1]]
