"""The flux falls with the square of the armature current: the poles saturate only under load.

    k Phi = (k Phi)_0 (1 - a (i / i_max)^2)

Source: A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, chapter on DC machines (the
demagnetising effect is none at small currents). a = 0: the flux that does not know the current.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "loss": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.9, plausible=0.2, unit="1", meaning="a"
    ),
}


def flux(value: float, s: Record, p: Record) -> float:
    """Flux under load [N m/A]."""
    if p.quadratic_armature_reaction_loss == 0.0:
        return value
    current = s.armature_current / p.armature_current_limit
    return value * (1.0 - p.quadratic_armature_reaction_loss * current * current)
