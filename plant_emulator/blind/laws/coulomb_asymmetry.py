"""The gear's Coulomb friction depends on the direction. Its viscous friction does not.

    T_f(omega_g) = ((1 + a sgn omega_g) f_gc + f_g |omega_g|^delta_g) sgn omega_g

Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083, section 2,
on left-right asymmetry of Coulomb friction. a = 0: the same in both directions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "coulomb_share": EffectParameter(
        neutral=0.0, lower=-0.9, upper=0.9, plausible=0.15, unit="1", meaning="a"
    ),
}


def gear_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction in the gear's direction of motion [N m]."""
    return value * (1.0 + p.coulomb_asymmetry_coulomb_share * s.gear_direction)
