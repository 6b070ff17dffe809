"""Coulomb friction of the gear builds up over a displacement in which its contacts yield.

    z' = omega_g - |omega_g| z / (k z_s),   Coulomb friction = f_gc z / z_s

Source: P. R. Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1 (1968), shape
1; B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083, on presliding.
z is the deflection of the contacts and f_gc / z_s their stiffness. In steady motion z = k z_s, with
the direction factor k of the friction (1 in the nominal model). z_s = 0 is a rigid contact.
Friction that other effects add stays rigid.
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
# Contacts that yield by less than this count as rigid [rad]; it is a twentieth of a micrometre at
# the teeth. Only single samples at a reversal differ, by less than the sensors' noise. The stage of
# a stiffer spring would not be solved.
RIGID = 5e-7
# Share of the Coulomb friction that stays rigid, so that a spring at rest stays at rest [1].
RIGID_SHARE = 1e-4


def start(p: Record) -> float:
    """Deflection of the contacts at the start of a run [rad]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Deflection of the contacts at the end of an implicit stage of size a [rad]."""
    z_s = p.presliding_displacement
    if z_s < RIGID:
        return base
    limit = s.gear_direction_factor * z_s
    return (base + a * s.gear_speed) / (1.0 + a * abs(s.gear_speed) / limit)


MEMORIES = {"bend": Memory(start, advance)}


def yielding(p: Record) -> float:
    """Part of the Coulomb friction that builds up over the displacement [N m]."""
    return (1.0 - RIGID_SHARE) * p.gear_coulomb_friction


def gear_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Part of the Coulomb friction that stays rigid, at which the gear sticks [N m]."""
    if p.presliding_displacement < RIGID:
        return value
    return max(0.0, value - yielding(p))


def gear_torque(value: float, s: Record, p: Record) -> float:
    """Torque of the deflected contacts, against positive speed of the gear output [N m]."""
    z_s = p.presliding_displacement
    if z_s < RIGID:
        return value
    return value + yielding(p) / z_s * s.presliding_bend
