"""The drive limits the armature current below its nominal largest current.

    |i_ref| <= I = i_max - R

The limit of an analogue controller sets in gradually: between I - w and I + w the current follows
the parabola that joins the line |i| and the constant I without a corner,

    |i_ref| = |i| - (|i| - I + w)^2 / (4 w),   w = min(r I, R)

Sources: W. Leonhard, Control of Electrical Drives, chapter on the cascade control of drives: the
limit of the speed controller's output is the limit of the current; D. Giannoulis, M. Massberg,
J. D. Reiss, J. Audio Eng. Soc. 60 (2012) 399, on limits with a soft knee. R is the distance of the
limit below i_max, r the rounding of the corner, which vanishes with R: the nominal limit has a
corner.
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
    "rounding": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.5, plausible=0.0, unit="1", meaning="r", std=0.1
    ),
}


def current_limit(value: float, s: Record, p: Record) -> float:
    """Limit of the current reference at the wanted current [A]."""
    if p.current_limit_reduction == 0.0:
        return value
    limit = max(0.0, value - p.current_limit_reduction)
    half = min(p.current_limit_rounding * limit, p.current_limit_reduction)
    wanted = abs(s.wanted_current)
    beyond = wanted - (limit - half)
    if beyond <= 0.0 or beyond >= 2.0 * half:
        return limit
    rounded: float = wanted - beyond * beyond / (4.0 * half)
    return rounded
