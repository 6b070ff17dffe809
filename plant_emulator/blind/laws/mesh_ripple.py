"""A damaged tooth of an intermediate shaft brakes the gear once per revolution of the shaft.

    T = A (1 + cos(n theta_g + phi)) / 2 against the motion

Source: P. D. McFadden, J. D. Smith, Mechanical Systems and Signal Processing 2 (1988) 165, on the
vibration of gears with a local fault. A = 0: sound teeth.
"""

from __future__ import annotations

from math import cos
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "torque": EffectParameter(
        neutral=0.0, lower=0.0, upper=500.0, plausible=25.0, unit="N m", meaning="A"
    ),
    "ratio": EffectParameter(
        neutral=4.3, lower=1.5, upper=20.0, plausible=4.3, unit="1", meaning="n"
    ),
    "phase": EffectParameter(
        neutral=0.0, lower=-6.3, upper=6.3, plausible=0.0, unit="rad", meaning="phi", per_run=True
    ),
}


def start(p: Record) -> float:
    """Angle of the gear output at the start of a run: its zero [rad]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Angle of the gear output at the end of an implicit stage of size a [rad]."""
    return base + a * s.gear_speed


MEMORIES = {"angle": Memory(start, advance)}


def gear_speed_friction(value: float, s: Record, p: Record) -> float:
    """Friction at the shaft's angle in addition to Coulomb and viscous friction [N m]."""
    torque = p.mesh_ripple_torque
    if torque == 0.0:
        return value
    wave = cos(p.mesh_ripple_ratio * s.mesh_ripple_angle + p.mesh_ripple_phase)
    return value + 0.5 * torque * (1.0 + wave)
