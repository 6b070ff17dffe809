"""A ramp generator limits the slope of the drive's reference and rounds both ends of the ramp.

    domega_r/dt = v,   tau dv/dt + v = limited((reference - omega_r) / (4 tau), omega_max / T)

Source: L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and Robots, on
trajectories with limited jerk. The gain 1 / (4 tau) lets the ramp end as fast as it can without
overshoot. T = 0: no limit.
"""

from __future__ import annotations

from math import copysign
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "ramp_time": EffectParameter(
        neutral=0.0, lower=0.0, upper=100.0, plausible=8.0, unit="s", meaning="T"
    ),
    "rounding_time": EffectParameter(
        neutral=0.015, lower=0.001, upper=1.0, plausible=0.015, unit="s", meaning="tau"
    ),
}


def start(p: Record) -> float:
    """Reference [rad/s] and its slope [rad/s^2] at the start of a run: the bench is at rest."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Limited reference at the end of an implicit stage of size a [rad/s]."""
    return base + a * s.rounded_ramp_slope


def advance_slope(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Slope of the reference there [rad/s^2]; it runs after `advance` and recovers its base."""
    ramp_time, tau = p.rounded_ramp_ramp_time, p.rounded_ramp_rounding_time
    if ramp_time == 0.0:
        return base
    steepest = p.speed_limit / ramp_time
    gap = value - (s.rounded_ramp_reference - a * s.rounded_ramp_slope)
    slope = (tau * base + a * gap / (4.0 * tau)) / (tau + a + a * a / (4.0 * tau))
    wanted = (gap - a * slope) / (4.0 * tau)
    if abs(wanted) > steepest:
        slope = (tau * base + a * copysign(steepest, wanted)) / (tau + a)
    return slope


MEMORIES = {
    "reference": Memory(start, advance),
    "slope": Memory(start, advance_slope, follows="reference"),
}


def reference(value: float, s: Record, p: Record) -> float:
    """Output of the ramp generator [rad/s]."""
    if p.rounded_ramp_ramp_time == 0.0:
        return value
    return s.rounded_ramp_reference
