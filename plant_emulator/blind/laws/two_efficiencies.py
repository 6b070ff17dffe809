"""The gear loses a share of the torque it transmits, a larger one while it drives the drum.

    T_l = a (1 + v) |T_gd| driving,   a (1 - v) |T_gd| driven

Source: G. Niemann, H. Winter, Maschinenelemente, vol. 2: the efficiency of a gear train depends on
the direction of the power. a = 0: a gear without losses by load.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "share": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.5, plausible=0.05, unit="1", meaning="a"
    ),
    "difference": EffectParameter(
        neutral=0.2, lower=0.0, upper=0.9, plausible=0.2, unit="1", meaning="v"
    ),
}


def gear_load_friction(value: float, s: Record, p: Record) -> float:
    """Friction beyond that of the table at the torque to the drum [N m]."""
    share = p.two_efficiencies_share
    if share == 0.0:
        return value
    torque = s.drum_shaft_torque
    side = 1.0 if torque * s.gear_direction > 0.0 else -1.0
    return value + share * (1.0 + p.two_efficiencies_difference * side) * abs(torque)
