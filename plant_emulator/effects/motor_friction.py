"""The motor has friction of its own: Coulomb friction of bearings and brushes, and windage.

    T_mw = T_c sgn omega_m + k omega_m |omega_m|

Sources: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083, section 2,
for Coulomb friction; A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, on the
mechanical losses of machines, for windage: turbulent drag rises with the square of the speed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "coulomb": EffectParameter(
        neutral=0.0, lower=0.0, upper=10.0, plausible=0.5, unit="N m", meaning="T_c"
    ),
    "windage": EffectParameter(
        neutral=0.0, lower=0.0, upper=1e-4, plausible=4e-6, unit="N m s^2", meaning="k"
    ),
}


def motor_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction of the motor [N m]."""
    return value + p.motor_friction_coulomb


def motor_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Windage divided by the motor speed [N m s/rad]."""
    return value + p.motor_friction_windage * abs(s.motor_speed)
