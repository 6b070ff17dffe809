"""Weights that bound the leverage of a sample in a step of least squares (pure).

A sample that a contact falls on has a slope that holds for microseconds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

# Largest leverage of a sample in a step of a fit: its share of what is known in one direction. On
# average it is the number of unknowns over that of samples, one of thousands. A sample of more has
# a contact fall on it: it tells to a microsecond when, and nothing of any step that moves the
# contact to another sample. A few of them held all parameters where they were. The first contact of
# a run tells where in the gap it began: a bound of a tenth lost that.
LARGEST_LEVERAGE = 0.3
# Rounds of the weights that bound it, and how far above the bound they may leave it.
LEVERAGE_ROUNDS, LEVERAGE_EXCEEDED = 8, 1.5


def bounding_weights(slopes: Sequence[Array], prior: Array) -> list[Array]:
    """Weights of the samples that bound their leverage, one array a run; 1 where it is small.

    They are those of a bounded-influence regression (C. L. Mallows; see P. J. Rousseeuw, A. M.
    Leroy, Robust Regression and Outlier Detection, chapter 1), found by iteration: one sample may
    hide another. Where samples are few the bound is what the ends of a polynomial of p coefficients
    have, p^2 / n.

    slopes : of each run, shape (samples, unknowns); prior : rows of the prior, which stay
    """
    scale = np.sqrt(sum(np.einsum("ni,ni->i", j, j) for j in (*slopes, prior)))
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled = [j / scale for j in slopes]
    weights = [np.ones(len(j)) for j in slopes]
    few = len(prior) ** 2 / max(1, sum(len(j) for j in slopes))
    bound = min(max(LARGEST_LEVERAGE, few), 0.5)
    for _ in range(LEVERAGE_ROUNDS):
        rows = [j * w[:, None] for j, w in zip(scaled, weights, strict=True)]
        gram = sum((j.T @ j for j in rows), (prior / scale).T @ (prior / scale))
        values, vectors = np.linalg.eigh(gram)
        if values[-1] <= 0.0:
            break
        turned = vectors / np.sqrt(np.maximum(values, np.finfo(float).eps * values[-1]))
        leverages = [np.sum((j @ turned) ** 2, axis=1) for j in rows]
        if max(float(h.max(initial=0.0)) for h in leverages) <= LEVERAGE_EXCEEDED * bound:
            break
        # Beside all others as they are, a sample of this weight has the bound.
        odds = [h / np.maximum(1.0 - h, np.finfo(float).eps) for h in leverages]
        weights = [
            w * np.sqrt(bound / (1.0 - bound) / np.maximum(o, bound / (1.0 - bound)))
            for w, o in zip(weights, odds, strict=True)
        ]
    return weights


def beside_residual(factor: Array, norm: float) -> Array:
    """Slopes with the products of a factor, beside a residual that lies along the first axis.

    factor : triangular, of weighted residuals and slopes side by side, shape (1 + n, 1 + n)
    norm : of the residual without weights
    returns shape (2 + n, n): what weights took from the residual is in the last row
    """
    along = factor[0, 1:]
    share = float(np.clip(factor[0, 0] / norm, -1.0, 1.0)) if norm else 0.0
    return np.stack([share * along, *factor[1:, 1:], np.sqrt(1.0 - share**2) * along])
