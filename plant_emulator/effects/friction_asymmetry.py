"""Friction of the gear differs by direction.

    T_f(omega_g) = (1 + a sgn omega_g) (f_gc + f_g |omega_g|^delta_g) sgn omega_g

Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083, section 2,
on left-right asymmetry of Coulomb and viscous friction. a > 0: more friction forwards. At rest the
friction is that of the direction in which the gear is driven.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
NEEDS = "a run in the other direction"
PARAMETERS = {
    "asymmetry": EffectParameter(
        neutral=0.0, lower=-0.9, upper=0.9, plausible=0.1, unit="1", meaning="a"
    ),
}


def gear_direction_factor(value: float, s: Record, p: Record) -> float:
    """Factor on the friction of the table in the direction of the gear [1]."""
    return value * (1.0 + p.friction_asymmetry_asymmetry * s.gear_direction)
