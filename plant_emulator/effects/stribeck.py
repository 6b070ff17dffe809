"""Friction of the gear rises towards standstill, where its teeth lose their oil film.

    T_s(omega_g) = dT exp(-(omega_g / omega_s)^2),   friction = that of the table + T_s

Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083, section 2
(Stribeck friction, exponential form, exponent 2). dT is the friction at rest beyond the Coulomb
friction.
"""

from __future__ import annotations

from math import exp
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
NEEDS = "long stretches below 0.5 rad/s of the drum"
PARAMETERS = {
    "rise": EffectParameter(
        neutral=0.0, lower=0.0, upper=500.0, plausible=60.0, unit="N m", meaning="dT"
    ),
    "speed": EffectParameter(
        neutral=0.1, lower=0.01, upper=2.0, plausible=0.1, unit="rad/s", meaning="omega_s"
    ),
}


def gear_speed_friction(value: float, s: Record, p: Record) -> float:
    """Friction beyond that of the table, by the gear's speed [N m]."""
    rise = p.stribeck_rise
    if rise == 0.0:
        return value
    share = s.gear_speed / p.stribeck_speed
    return value + rise * exp(-share * share)
