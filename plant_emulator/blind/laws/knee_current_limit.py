"""The drive limits the armature current smoothly, with a knee instead of a corner.

    |i_ref| = |i| below (1 - n) I,   I (1 - n) + n I tanh((|i| - (1 - n) I) / (n I)) above it
    I = i_max - R

Source: A. H. Glattfelder, W. Schaufelberger, Control Systems with Input and Output Constraints, on
smooth saturations. R = 0: the nominal limit, with its corner.
"""

from __future__ import annotations

from math import tanh
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "reduction": EffectParameter(
        neutral=0.0, lower=0.0, upper=71.0, plausible=50.0, unit="A", meaning="R"
    ),
    "knee": EffectParameter(
        neutral=0.1, lower=0.01, upper=0.5, plausible=0.1, unit="1", meaning="n"
    ),
}


def current_limit(value: float, s: Record, p: Record) -> float:
    """Limit of the current reference at the wanted current [A]."""
    if p.knee_current_limit_reduction == 0.0:
        return value
    largest = max(0.0, value - p.knee_current_limit_reduction)
    bend = p.knee_current_limit_knee * largest
    beyond = abs(s.wanted_current) - (largest - bend)
    if beyond <= 0.0 or bend == 0.0:
        return largest
    return largest - bend + bend * tanh(beyond / bend)
