"""The drum's bearings have Coulomb and viscous friction.

    T_dw = T_c sgn omega_d + b omega_d

Source: SKF, Rolling Bearings catalogue, chapter on bearing friction: a load-dependent torque that
hardly knows the speed (with that of the seals), and a torque of the lubricant that rises with it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "drum"
PARAMETERS = {
    "coulomb": EffectParameter(
        neutral=0.0, lower=0.0, upper=500.0, plausible=20.0, unit="N m", meaning="T_c"
    ),
    "viscous": EffectParameter(
        neutral=0.0, lower=0.0, upper=100.0, plausible=5.0, unit="N m s/rad", meaning="b"
    ),
}


def drum_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Level of the bearings' Coulomb friction [N m]."""
    return value + p.drum_bearing_friction_coulomb


def drum_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Speed-proportional friction of the bearings [N m s/rad]."""
    return value + p.drum_bearing_friction_viscous
