"""Which phase of operation each sample of a run belongs to.

Standstill, breakaway, acceleration, cruise and deceleration share the samples of a run among them;
field weakening is the mask of those above base speed, across the others.
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
# Window of the slope [s]; a tachometer's noise of 0.15 rad/s leaves 0.15 rad/s^2 of it at 100 Hz.
WINDOW = 0.5
# A slope of the motor speed that is a ramp [rad/s^2], and a speed that is a motion [rad/s]: after a
# stop the speed integrator unwinds, and the motor creeps at up to 0.3 rad/s.
RAMP = 3.0
MOVING = 1.0
# How long leaving standstill takes: the gap is crossed within it [s].
BREAKAWAY_TIME = 0.5


def phases(time: Array, reference: Array, motor_speed: Array) -> NDArray[np.int_]:
    """Phase of every sample as its place in PHASES, shape (n,).

    reference, motor_speed : [rad/s]
    """
    speed = smooth(time, motor_speed, WINDOW / 5)
    slope = np.sign(speed) * smooth(time, motor_speed, WINDOW, 1)
    found = np.full(len(time), CRUISE)
    found[slope > RAMP] = ACCELERATION
    found[slope < -RAMP] = DECELERATION
    still = np.abs(speed) < MOVING
    found[still] = STANDSTILL
    leaving = still & (np.abs(reference) > MOVING)
    begin = np.flatnonzero(still[:-1] & ~still[1:])
    for k in begin:
        leaving |= ~still & (time > time[k]) & (time <= time[k] + BREAKAWAY_TIME)
    found[leaving & (found != DECELERATION)] = BREAKAWAY
    return found


def field_weakened(motor_speed: Array, base_speed: float) -> NDArray[np.bool_]:
    """Which samples lie above base speed [rad/s], shape (n,)."""
    return np.asarray(np.abs(motor_speed) > base_speed)
