"""Coulomb friction of the gear acts like a spring up to a displacement, and then slides.

    z' = omega_g while |z| < k z_s, then 0 outwards;   Coulomb friction = f_gc z / z_s

Source: P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, IEEE Trans. Automatic Control 47 (2002)
787 (elastoplastic friction), here one Maxwell slip element. z_s = 0: a rigid contact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "displacement": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.1, plausible=5e-3, unit="rad", meaning="z_s"
    ),
}

# Rigid share of the Coulomb friction, which keeps a bench at rest exactly at rest.
RIGID_SHARE = 1e-4


def start(p: Record) -> float:
    """Deflection of the contacts at the start of a run [rad]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Deflection of the contacts at the end of an implicit stage of size a [rad]."""
    if p.elastoplastic_presliding_displacement == 0.0:
        return base
    limit = s.gear_direction_factor * p.elastoplastic_presliding_displacement
    return max(-limit, min(limit, base + a * s.gear_speed))


MEMORIES = {"bend": Memory(start, advance)}


def gear_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """The rigid share of the Coulomb friction, at which the gear sticks [N m]."""
    if p.elastoplastic_presliding_displacement == 0.0:
        return value
    return max(0.0, value - (1.0 - RIGID_SHARE) * p.gear_coulomb_friction)


def gear_torque(value: float, s: Record, p: Record) -> float:
    """Torque of the deflected contacts against the motion of the gear output [N m]."""
    if p.elastoplastic_presliding_displacement == 0.0:
        return value
    stiffness = (
        (1.0 - RIGID_SHARE) * p.gear_coulomb_friction / p.elastoplastic_presliding_displacement
    )
    return value + stiffness * s.elastoplastic_presliding_bend
