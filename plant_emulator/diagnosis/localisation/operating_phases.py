"""The phase of operation of each sample of a run.

Standstill, breakaway, acceleration, cruise and deceleration divide the samples of a run. Field
weakening is a mask across these phases, of the samples above base speed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

PHASES = ("standstill", "breakaway", "acceleration", "cruise", "deceleration", "field_weakening")
STANDSTILL, BREAKAWAY, ACCELERATION, CRUISE, DECELERATION = range(5)
# Window of the slope [s]. A tachometer's noise of 0.15 rad/s leaves 0.15 rad/s^2 of it at 100 Hz.
SLOPE_WINDOW = 0.5
# The motor speed ramps from this slope on [rad/s^2].
RAMP = 3.0
# The motor moves from this speed on [rad/s]. After a stop the speed integrator unwinds, and the
# motor creeps at up to 0.3 rad/s.
MOVING_SPEED = 1.0
# The gear crosses the backlash within this time after standstill [s].
BREAKAWAY_TIME = 0.5


def phases(time: Array, reference: Array, motor_speed: Array) -> NDArray[np.int_]:
    """Phase of each sample as its index in PHASES, shape (n,).

    time : [s]; reference, motor_speed : [rad/s]; shape (n,) each
    """
    speed = smooth(time, motor_speed, SLOPE_WINDOW / 5)
    slope = np.sign(speed) * smooth(time, motor_speed, SLOPE_WINDOW, 1)
    found = np.full(len(time), CRUISE)
    found[slope > RAMP] = ACCELERATION
    found[slope < -RAMP] = DECELERATION
    still = np.abs(speed) < MOVING_SPEED
    found[still] = STANDSTILL
    leaving = still & (np.abs(reference) > MOVING_SPEED)
    begin = np.flatnonzero(still[:-1] & ~still[1:])
    for k in begin:
        leaving |= ~still & (time > time[k]) & (time <= time[k] + BREAKAWAY_TIME)
    found[leaving & (found != DECELERATION)] = BREAKAWAY
    return found


def field_weakened(motor_speed: Array, base_speed: float) -> NDArray[np.bool_]:
    """Whether the field is weakened at each sample, shape (n,); speeds [rad/s]."""
    return np.asarray(np.abs(motor_speed) > base_speed)
