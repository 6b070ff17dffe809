"""How far the size of an effect may be off because the machine follows another law of it.

A standard error of a fit holds the noise, not that the machine's oil or tyre may follow another
equation than the library's. How much that matters shows where the truth is known: effects hidden
by other laws, fitted by the library's. Their deviation joins the standard error, as the error of a
method joins that of a reading (JCGM 100:2008, 5.1.2 and G.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri, stdtrit

if TYPE_CHECKING:
    from collections.abc import Sequence

# Of the intervals that are to hold.
PROBABILITY = 0.975


@dataclass(frozen=True, kw_only=True)
class Sized:
    """A size hidden by another law, and what the library's law took it for, both in its unit.

    name : of the parameter, the effect's name before it; plausible : size that is usual for it
    """

    name: str
    true: float
    estimated: float
    standard_error: float
    plausible: float


def law_errors(cases: Sequence[Sized]) -> dict[str, float]:
    """Standard error of each size that other laws make, relative to `scale` of the estimate.

    The root mean square of what deviates beyond the noise, widened by Student's t over the normal
    quantile: it is known from a few cases only.
    """
    return {name: _relative([c for c in cases if c.name == name]) for name in _names(cases)}


def scale(estimated: float, plausible: float) -> float:
    """What a law's error is relative to: the estimate, but no less than the plausible size.

    What another law takes from a size it may take nearly all of.
    """
    return max(abs(estimated), plausible)


def _names(cases: Sequence[Sized]) -> list[str]:
    return sorted({c.name for c in cases})


def _relative(cases: Sequence[Sized]) -> float:
    squares = [
        max(0.0, (c.true - c.estimated) ** 2 - c.standard_error**2)
        / scale(c.estimated, c.plausible) ** 2
        for c in cases
    ]
    widened = stdtrit(len(cases), PROBABILITY) / ndtri(PROBABILITY)
    return float(widened * np.sqrt(np.mean(squares)))
