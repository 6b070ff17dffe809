"""The drum's bearings have Coulomb friction and the friction of a shear-thinning grease.

    T_dw = T_c sgn omega_d + b omega_d / (1 + |omega_d| / omega_s)

Source: P. M. Lugt, Grease Lubrication in Rolling Bearings (2013): the apparent viscosity of a
grease falls with the shear rate. T_c, b = 0: no friction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drum"
PARAMETERS = {
    "coulomb": EffectParameter(
        neutral=0.0, lower=0.0, upper=500.0, plausible=20.0, unit="N m", meaning="T_c"
    ),
    "grease": EffectParameter(
        neutral=0.0, lower=0.0, upper=100.0, plausible=8.0, unit="N m s/rad", meaning="b"
    ),
    "thinning_speed": EffectParameter(
        neutral=5.0, lower=1.0, upper=50.0, plausible=5.0, unit="rad/s", meaning="omega_s"
    ),
}


def drum_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction of the drum's bearings [N m]."""
    return value + p.shear_thinning_drum_coulomb


def drum_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Torque of the grease divided by the drum speed [N m s/rad]."""
    thinned = 1.0 + abs(s.drum_speed) / p.shear_thinning_drum_thinning_speed
    grease: float = p.shear_thinning_drum_grease / thinned
    return value + grease
