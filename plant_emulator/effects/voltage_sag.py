"""The available armature voltage falls under load.

    |u_a| <= u_max - R_s |i|

Source: N. Mohan, T. M. Undeland, W. P. Robbins, Power Electronics, chapter on line-frequency
controlled rectifiers: their direct voltage falls in proportion to the current, for commutation and
supply. R_s is that ratio.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "drive"
NEEDS = "a run above base speed up to the voltage limit, or armature_voltage_V logged"
PARAMETERS = {
    "source_resistance": EffectParameter(
        neutral=0.0, lower=0.0, upper=4.0, plausible=1.5, unit="ohm", meaning="R_s"
    ),
}


def voltage_limit(value: float, s: Record, p: Record) -> float:
    """Largest armature voltage [V]."""
    return max(0.0, value - p.voltage_sag_source_resistance * abs(s.armature_current))
