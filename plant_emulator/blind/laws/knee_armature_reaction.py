"""Above a rounded knee the flux falls in proportion to the armature current; below it hardly.

    k Phi = (k Phi)_0 (1 - a (hypot(x, x_k) - x_k) / (hypot(1, x_k) - x_k)),  x = i / i_max

Source: A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, chapter on DC machines (an
unsaturated pole tip loses no flux). a = 0: flux independent of the current.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "loss": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.9, plausible=0.15, unit="1", meaning="a"
    ),
    "knee": EffectParameter(
        neutral=0.25, lower=0.05, upper=1.0, plausible=0.25, unit="1", meaning="x_k"
    ),
}


def flux(value: float, s: Record, p: Record) -> float:
    """Flux under load [N m/A]."""
    if p.knee_armature_reaction_loss == 0.0:
        return value
    knee = p.knee_armature_reaction_knee
    above = math.hypot(s.armature_current / p.armature_current_limit, knee) - knee
    most = math.hypot(1.0, knee) - knee
    return value * (1.0 - p.knee_armature_reaction_loss * above / most)
