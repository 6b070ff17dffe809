"""Leads a fit over a kink of its cost (pure).

As an unknown changes, instants of contact pass from sample to sample, and each leaves a kink or a
narrow minimum in the cost. A descent along slopes stalls there. A change of one unknown alone
passes it (pattern search: R. Hooke, T. Jeeves, J. ACM 8 (1961) 212).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.estimation.unknowns import Residual, Unknown

# Changes of an unknown that are tried, on the scale of the estimation: above the steps of the
# slopes, up to where a fit would go by itself. Half and twice the best one are tried too.
CHANGES = tuple(sign * 2e-4 * 4.0**k for k in range(4) for sign in (1.0, -1.0))
# Fall of the cost that a kink must hide, as a share: below, what is left is another cause.
WORTH = 0.1


def beyond_kink(
    unknowns: Sequence[Unknown], residuals: Sequence[Residual]
) -> tuple[Unknown, ...] | None:
    """Start beyond the kink that the starts of the unknowns lie at; None: at none worth passing.

    residuals : one function a run, from the values by name to the whitened residual
    """
    costs = [_cost(residual, unknowns, k) for k, residual in enumerate(residuals)]
    here = sum(costs)

    def changed(j: int, change: float) -> tuple[float, float, tuple[Unknown, ...]]:
        u = unknowns[j]
        value = float(np.clip(u.value(u.scaled(u.start) + change), u.lower, u.upper))
        trial = (*unknowns[:j], replace(u, start=value), *unknowns[j + 1 :])
        runs = range(len(residuals)) if u.run is None else (u.run,)
        return here + sum(_cost(residuals[k], trial, k) - costs[k] for k in runs), change, trial

    trials = [(*changed(j, change), j) for j in range(len(unknowns)) for change in CHANGES]
    best = min(trials, key=lambda one: one[0])
    nearby = [(*changed(best[3], factor * best[1]), best[3]) for factor in (0.5, 2.0)]
    cost, _, start, _ = min((best, *nearby), key=lambda one: one[0])
    return start if cost < (1.0 - WORTH) * here else None


def _cost(residual: Residual, unknowns: Sequence[Unknown], run: int) -> float:
    """Sum of squares of a run at the starts of the unknowns."""
    return float(np.sum(residual(_values(unknowns, run)) ** 2))


def _values(unknowns: Sequence[Unknown], run: int) -> Mapping[str, float]:
    return {u.name: u.start for u in unknowns if u.run in {None, run}}
