"""The drive limits the armature current below its nominal largest current.

    |i_ref| <= i_max - R

Source: W. Leonhard, Control of Electrical Drives, chapter on the cascade control of drives: the
limit of the speed controller's output is the limit of the current. R is the distance of the limit
below i_max.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "reduction": EffectParameter(
        neutral=0.0, lower=0.0, upper=71.0, plausible=50.0, unit="A", meaning="R"
    ),
}


def current_limit(value: float, s: Record, p: Record) -> float:
    """Largest current reference [A]."""
    return max(0.0, value - p.current_limit_reduction)
