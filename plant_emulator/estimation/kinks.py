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
# slopes, up to where a fit would go by itself.
CHANGES = tuple(1e-4 * 2.0**k for k in range(8))
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
    best, start = (1.0 - WORTH) * here, None
    for j, u in enumerate(unknowns):
        for change in (sign * size for size in CHANGES for sign in (1.0, -1.0)):
            scaled = u.scaled(u.start) + change
            value = float(np.clip(u.value(scaled), u.lower, u.upper))
            trial = (*unknowns[:j], replace(u, start=value), *unknowns[j + 1 :])
            runs = range(len(residuals)) if u.run is None else (u.run,)
            cost = here + sum(_cost(residuals[k], trial, k) - costs[k] for k in runs)
            if cost < best:
                best, start = cost, trial
    return start


def _cost(residual: Residual, unknowns: Sequence[Unknown], run: int) -> float:
    """Sum of squares of a run at the starts of the unknowns."""
    return float(np.sum(residual(_values(unknowns, run)) ** 2))


def _values(unknowns: Sequence[Unknown], run: int) -> Mapping[str, float]:
    return {u.name: u.start for u in unknowns if u.run in {None, run}}
