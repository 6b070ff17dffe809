"""The motor's rotor is not centred in the field, so the flux ripples once per revolution.

    k Phi = (k Phi)_0 (1 + a cos(theta_m + phi))

Source: A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, on the influence of the air
gap on the flux. a = 0: a centred rotor.
"""

from __future__ import annotations

from math import cos
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "amplitude": EffectParameter(
        neutral=0.0, lower=-0.5, upper=0.5, plausible=0.03, unit="1", meaning="a"
    ),
    "phase": EffectParameter(
        neutral=0.0, lower=-6.3, upper=6.3, plausible=0.0, unit="rad", meaning="phi", per_run=True
    ),
}


def start(p: Record) -> float:
    """Angle of the rotor at the start of a run: its zero [rad]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Angle of the rotor at the end of an implicit stage of size a [rad]."""
    return base + a * s.motor_speed


MEMORIES = {"angle": Memory(start, advance)}


def flux(value: float, s: Record, p: Record) -> float:
    """Flux at the rotor's angle [N m/A]."""
    amplitude = p.torque_ripple_amplitude
    if amplitude == 0.0:
        return value
    return value * (1.0 + amplitude * cos(s.torque_ripple_angle + p.torque_ripple_phase))
