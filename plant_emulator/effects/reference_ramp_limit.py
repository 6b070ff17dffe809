"""The drive limits the slope of its speed reference, as a ramp generator does.

    domega_r/dt = (reference - omega_r) / tau,   limited to +-omega_max / T

Source: W. Leonhard, Control of Electrical Drives, chapter on the cascade control of drives: a ramp
generator is a loop of a limited amplifier and an integrator. omega_max is the drive's largest
speed. T is the time from standstill to omega_max, which drives call ramp-up time. T = 0: no limit.
tau rounds the end of a ramp, by the finite gain of the amplifier. tau = 0: the ramp has a corner.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "ramp_time": EffectParameter(
        neutral=0.0, lower=0.0, upper=100.0, plausible=8.0, unit="s", meaning="T"
    ),
    "landing_time": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.5, plausible=0.0, unit="s", meaning="tau", std=0.05
    ),
}


def start(p: Record) -> float:
    """The bench starts at rest [rad/s]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Limited reference at the end of an implicit stage of size a [rad/s]."""
    ramp_time = p.reference_ramp_limit_ramp_time
    if ramp_time == 0.0:
        return base
    reach, wanted = a * p.speed_limit / ramp_time, value - base
    if p.reference_ramp_limit_landing_time > 0.0:
        wanted *= a / (p.reference_ramp_limit_landing_time + a)
    return base + max(-reach, min(reach, wanted))


MEMORIES = {"reference": Memory(start, advance, follows="reference")}


def reference(value: float, s: Record, p: Record) -> float:
    """Reference behind the ramp generator [rad/s]."""
    if p.reference_ramp_limit_ramp_time == 0.0:
        return value
    return s.reference_ramp_limit_reference
