"""The observer: a run that is led along a measured one.

At some samples the speeds are corrected by a share of what they have missed since the correction
before (D. Luenberger, IEEE Trans. Autom. Control 16 (1971) 596), beyond a dead zone for the noise,
as in adaptive control (B. Peterson, K. Narendra, IEEE Trans. Autom. Control 27 (1982) 1161).
Without the dead zone the right simulation would follow the noise: a drum without losses crosses the
backlash within seconds, and an error of a thousandth of its speed moves the next contact.
"""

from __future__ import annotations

from math import isnan
from typing import TYPE_CHECKING

from plant_emulator.model.stage import BACKLASH, DRUM_SPEED, GEAR_SPEED, MOTOR_SPEED

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

# Gain of the observer: share of the missed speed that one correction gives back, enough to end a
# drift within some of them.
OBSERVER_GAIN = 0.6


def missed(first: int, last: int, measured: State, column: int, out: State) -> float:
    """Mean of measured minus simulated in these samples, of those that are measured [rad/s]."""
    total, count = 0.0, 0
    for row in range(first, last + 1):
        difference = measured[row] - out[row, column]
        if not isnan(difference):
            total += difference
            count += 1
    return total / count if count > 0 else 0.0


def beyond(value: float, dead_zone: float) -> float:
    """The part of a value beyond a dead zone on either side of 0."""
    return max(value - dead_zone, 0.0) + min(value + dead_zone, 0.0)


def correct(
    first: int,
    last: int,
    measured: tuple[State, State, State],
    out: State,
    x: State,
    s: Record,
    p: Record,
) -> None:
    """Correct the speeds by a share of what they have missed in these samples.

    Motor and gear move together, and in contact the drum moves with them, so that its torque does
    not jump.

    measured : speed of the motor, of the drum, and the dead zones of both [rad/s]
    """
    motor_speed, drum_speed, dead_zones = measured
    motor = OBSERVER_GAIN * beyond(missed(first, last, motor_speed, 0, out), dead_zones[0])
    drum = motor / p.gear_ratio
    x[MOTOR_SPEED] += motor
    x[GEAR_SPEED] += drum
    if abs(x[BACKLASH]) < s.backlash_half_gap:
        drum = OBSERVER_GAIN * beyond(missed(first, last, drum_speed, 1, out), dead_zones[1])
    x[DRUM_SPEED] += drum
