"""The flux falls with the armature current, whose field saturates one tip of each pole.

    k Phi = (k Phi)_0 (1 - a (|i| / i_max)^n)

Source: A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, chapter on DC machines
(armature reaction and its demagnetising effect). The loss is proportional to the current where the
pole tips are saturated (n = 1), and to its square where saturation begins (n = 2). i_max is the
drive's nominal current limit; a is the share of the flux that is lost there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "share": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.5, plausible=0.1, unit="1", meaning="a"
    ),
    "exponent": EffectParameter(
        neutral=1.0, lower=0.5, upper=3.0, plausible=1.0, unit="1", meaning="n", std=0.5
    ),
}


def flux(value: float, s: Record, p: Record) -> float:
    """Flux under load [N m/A]."""
    if p.armature_reaction_share == 0.0:
        return value
    current = abs(s.armature_current) / p.armature_current_limit
    lost: float = current**p.armature_reaction_exponent
    return value * (1.0 - p.armature_reaction_share * lost)
