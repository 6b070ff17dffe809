"""Upper bound of the share of the gap that a law over the candidate states closes.

Runs that nothing was fitted to are the judge, as they are of a law. Each quantity has candidates:
curves over each of its states (linear splines, lags, harmonics of an angle), their sum over all
states, each with weak and strong penalties, and the best law of the grammar. The bound is the
largest share of the relations' squares beyond the noise that one of them closes. The best of many
candidates is also the luckiest one: that makes a bound larger, not too small.

The bound says nothing of laws over states that nobody measured, of products that the grammar lacks,
and of two quantities at once. Its share belongs to the parity relations, which judge every interval
by itself. A simulation adds errors up, so that the share of a draft may be larger. The caller
therefore takes the larger one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.linear_splines import linear_splines
from plant_emulator.diagnosis.missing_law.curve import knots_of
from plant_emulator.diagnosis.missing_law.grammar import factors
from plant_emulator.diagnosis.missing_law.law_search import columns_of
from plant_emulator.diagnosis.missing_law.reduced import WIDE_PRIOR, products
from plant_emulator.diagnosis.prediction import block_bootstrap

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
    from plant_emulator.diagnosis.missing_law.law_search import LawSearch
    from plant_emulator.diagnosis.missing_law.reduced import NuisanceProducts, RunRows
    from plant_emulator.diagnosis.missing_law.states import LawState
    from plant_emulator.signals.log import Array

# Prior standard deviations of a curve's coefficients, whose columns have the length 1 in the noise.
PENALTIES = (10.0, 100.0, WIDE_PRIOR)
# There is a gap from so many standard deviations of the noise's sum of squares on.
SURPRISING = 3.0


@dataclass(frozen=True, kw_only=True)
class Bound:
    """The largest share of the gap that a law over the candidate states closes held out [1].

    interval : 95 % interval, by drawing blocks of the runs anew
    """

    share: float
    interval: tuple[float, float]


def estimate_bound(
    regression: BlockRegression, rows: Sequence[RunRows], searches: Sequence[LawSearch]
) -> Bound | None:
    """The bound over all quantities; None: the runs show no gap beyond chance in the relations.

    rows : of all runs without a law
    """
    none = [np.zeros((len(own.y), 0)) for own in rows]
    before = _squares(regression, rows, none, products(rows, none), ())
    counts = [
        _of_intervals((own.y != 0.0).astype(np.float64), one.size)
        for one, own in zip(before, rows, strict=True)
    ]
    lengths = [block_bootstrap.block_length(np.sqrt(one)) for one in before]
    total = sum(one.sum() for one in counts)
    excess = sum(one.sum() for one in before) - total
    if excess < SURPRISING * np.sqrt(2.0 * total):
        return None
    noise = block_bootstrap.resampled_sums(counts, lengths)
    drawn_before = block_bootstrap.resampled_sums(before, lengths) - noise
    drawn_before[drawn_before <= 0.0] = np.nan
    share, best = -np.inf, np.full(noise.shape, -np.inf)
    for one in searches:
        for left in _candidates(regression, one):
            found = 1.0 - max(0.0, sum(own.sum() for own in left) - total) / excess
            drawn = np.maximum(block_bootstrap.resampled_sums(left, lengths) - noise, 0.0)
            share = max(share, float(found))
            best = np.maximum(best, 1.0 - drawn / drawn_before)
    low, high = np.nanquantile(best, [0.025, 0.975])
    return Bound(share=share, interval=(float(low), float(high)))


def _candidates(regression: BlockRegression, one: LawSearch) -> Iterator[list[Array]]:
    """Squares that each candidate of a quantity leaves in the held-out runs."""
    rows = one.rows.runs
    law = [one.terms[j] for j in one.list_nested()[-1]]
    columns, p = columns_of(one.rows, one.quantity, law)
    yield _squares(regression, rows, columns, p, range(len(p.own)))
    columns, own, ends = _curves(one)
    p = products(rows, columns, own)
    begins = [0, *ends[:-1]]
    groups = [range(a, b) for a, b in zip(begins, ends, strict=True)]
    for chosen in (*groups, range(len(own))):
        for width in PENALTIES:
            yield _squares(regression, rows, columns, replace(p, width=width), chosen)


def _curves(one: LawSearch) -> tuple[list[Array], list[bool], list[int]]:
    """Columns of the curves over all states, which are of a run's own, and each state's end."""
    runs, quantity = range(len(one.rows.runs)), one.quantity
    bases = [[_basis(state, k) for k in runs] for state in quantity.states]
    own = [
        state.kind == "angle"
        for state, basis in zip(quantity.states, bases, strict=True)
        for _ in range(basis[0].shape[1])
    ]
    columns = one.rows.of([np.concatenate([basis[k] for basis in bases], axis=1) for k in runs])
    return columns, own, np.cumsum([basis[0].shape[1] for basis in bases]).tolist()


def _basis(state: LawState, run: int) -> Array:
    """Basis of the curves over a state: splines, and its lags; of an angle its harmonics."""
    none = np.zeros((len(state.values[run]), 0))  # an angle that hardly turns has no harmonics
    parts = [
        none,
        *(
            factor.values(run)
            for factor in factors(state)
            if factor.function in {"delay", "lag", "turn", "play"}
        ),
    ]
    if state.kind not in {"angle", "followed"}:
        parts.append(linear_splines(state.values[run], knots_of(state)))
    return np.concatenate(parts, axis=1)


def _squares(
    regression: BlockRegression,
    rows: Sequence[RunRows],
    columns: Sequence[Array],
    p: NuisanceProducts,
    chosen: Sequence[int],
) -> list[Array]:
    """Squares that a fit to the other runs leaves in each interval, shape (1, n - 1) a run."""
    found = []
    for k, (own, part) in enumerate(zip(rows, columns, strict=True)):
        others = [run for run in range(len(rows)) if run != k]
        left = own.squares(p.left(chosen, others, k, own, part))
        found.append(_of_intervals(left, len(regression.weights[k]) - 1))
    return found


def _of_intervals(squares: Array, intervals: int) -> Array:
    """Sums over the relations of an interval and the drum speed at its end, shape (1, n - 1)."""
    relations = len(squares) - intervals - 1
    speed = squares[relations:]
    found = squares[:relations].reshape(intervals, -1).sum(axis=1) + speed[1:]
    found[0] += speed[0]
    return np.asarray(found)[None]
