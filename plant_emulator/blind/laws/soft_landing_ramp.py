"""A ramp generator limits the slope of the drive's reference and rounds the end of the ramp.

    domega_r/dt = limited((reference - omega_r) / tau, omega_max / T)

Source: W. Leonhard, Control of Electrical Drives, chapter on the cascade control of drives: a ramp
generator as a loop of a limited amplifier and an integrator. T = 0: no limit.
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
        neutral=0.03, lower=0.001, upper=1.0, plausible=0.03, unit="s", meaning="tau"
    ),
}


def start(p: Record) -> float:
    """Limited reference at the start of a run: 0, because the bench is at rest [rad/s]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Limited reference at the end of an implicit stage of size a [rad/s]."""
    ramp_time, tau = p.soft_landing_ramp_ramp_time, p.soft_landing_ramp_landing_time
    if ramp_time == 0.0:
        return base
    reach = a * p.speed_limit / ramp_time
    return base + max(-reach, min(reach, a * (value - base) / (tau + a)))


MEMORIES = {"reference": Memory(start, advance, follows="reference")}


def reference(value: float, s: Record, p: Record) -> float:
    """Output of the ramp generator [rad/s]."""
    if p.soft_landing_ramp_ramp_time == 0.0:
        return value
    return s.soft_landing_ramp_reference
