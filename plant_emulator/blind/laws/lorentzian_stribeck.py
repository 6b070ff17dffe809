"""Friction of the gear rises towards standstill (Stribeck effect) in the form of Hess and Soom.

    T_s(omega_g) = dT / (1 + (omega_g / omega_s)^2)

Source: D. P. Hess, A. Soom, J. Tribology 112 (1990) 147. dT: additional friction at rest beyond the
Coulomb friction. dT = 0: no rise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "rise": EffectParameter(
        neutral=0.0, lower=0.0, upper=500.0, plausible=60.0, unit="N m", meaning="dT"
    ),
    "width": EffectParameter(
        neutral=0.1, lower=0.01, upper=2.0, plausible=0.1, unit="rad/s", meaning="omega_s"
    ),
}


def gear_speed_friction(value: float, s: Record, p: Record) -> float:
    """Friction at the gear's speed in addition to Coulomb and viscous friction [N m]."""
    if p.lorentzian_stribeck_rise == 0.0:
        return value
    share = s.gear_speed / p.lorentzian_stribeck_width
    return value + p.lorentzian_stribeck_rise / (1.0 + share * share)
