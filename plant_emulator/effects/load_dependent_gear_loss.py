"""Friction of the gear proportional to the torque that it transmits.

    T_l = a (1 + d) |T_gd| driving,   a (1 - d) |T_gd| driven,   friction = that of the table + T_l

Sources: ISO/TR 14179-1 (2001), load-dependent losses: sliding in the meshes takes a share of the
transmitted power; G. Niemann, H. Winter, Maschinenelemente, vol. 2: the share differs between the
two directions of the power. The loss acts against the motion, whichever side drives. At d = 0 the
motor side gives (1 + a) T_gd while it drives, an efficiency of 1 / (1 + a), and receives
(1 - a) |T_gd| while it is driven. One mesh of ground teeth takes 0.01 to 0.02. This gear has three
meshes, and bearings.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "share": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.5, plausible=0.05, unit="1", meaning="a"
    ),
    "difference": EffectParameter(
        neutral=0.0, lower=-0.9, upper=0.9, plausible=0.0, unit="1", meaning="d", std=0.2
    ),
}


def gear_load_friction(value: float, s: Record, p: Record) -> float:
    """Friction beyond that of the table, by the torque to the drum [N m]."""
    share = p.load_dependent_gear_loss_share
    if share == 0.0:
        return value
    torque = s.drum_shaft_torque
    side = 1.0 if torque * s.gear_direction > 0.0 else -1.0
    return value + share * (1.0 + side * p.load_dependent_gear_loss_difference) * abs(torque)
