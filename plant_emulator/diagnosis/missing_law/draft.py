"""From the runs and the fit without effects to the laws that are worth a test by simulation.

The regression tells of every quantity which laws close the gap of runs that they were not fitted
to. A test by simulation then decides among few of them (`hypothesis_test`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
from plant_emulator.diagnosis.machines.thinning import thin
from plant_emulator.diagnosis.missing_law.bound import estimate_bound
from plant_emulator.diagnosis.missing_law.curve import curve
from plant_emulator.diagnosis.missing_law.law_search import DRAFTED_GAIN, search
from plant_emulator.diagnosis.missing_law.line_scan import with_lines
from plant_emulator.diagnosis.missing_law.quantities import quantities
from plant_emulator.diagnosis.missing_law.reduced import law_rows
from plant_emulator.diagnosis.missing_law.row_noise import row_noise

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import Curve
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.localisation.parity_relations import WhitenedRelations
    from plant_emulator.diagnosis.machines.thinning import Thinned
    from plant_emulator.diagnosis.missing_law.bound import Bound
    from plant_emulator.diagnosis.missing_law.law_search import Law, LawSearch
    from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
    from plant_emulator.diagnosis.missing_law.reduced import LawRows
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# At most so many laws are tested by simulation: each takes a fit a fold.
MOST_LAWS = 3
# Share of the best law's held-out gain from which on another law is an alternative.
ALTERNATIVE_SHARE = 0.8


@dataclass(frozen=True, kw_only=True, eq=False)
class Sketch:
    """A law that is worth a test by simulation.

    curve : the same quantity over the law's first state, without a formula
    parameters : what the regression with the law says of the bench's free parameters [SI]
    """

    law: Law
    curve: Curve
    parameters: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class Sketchbook:
    """Laws that are worth a test, the best one first; empty where no law closes a gap.

    bound : how much of the gap any law could close; None: the relations show no gap
    """

    sketches: tuple[Sketch, ...]
    bound: Bound | None


def sketch(
    recordings: Sequence[Recording], parameters: ParameterSet, null: FitResult
) -> Sketchbook:
    """Sketch the laws that are worth a test, and bound what any law could close.

    Of a channel that is sampled and held only the new values count, as in the relations of a
    diagnosis.

    null : converged fit without effects; at least two recordings, because other runs judge
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        thinned = [thin(one, one.use) for one in recordings]
        regression = BlockRegression([one.recording for one in thinned], parameters, null)
        counted = [_counted(*pair) for pair in zip(thinned, regression.relations, strict=True)]
        every = [
            (one, law_rows(regression, one).mapped(lambda run, rows: rows * counted[run]))
            for one in quantities(regression)
        ]
        searches = _searches([(with_lines(rows, one), rows) for one, rows in every])
        best = max(searches, key=lambda one: one.score(one.list_nested()[-1]))
        noise = row_noise(regression, best.left(best.list_nested()[-1]))
        searches = _searches([(one.quantity, one.rows.mapped(noise.white)) for one in searches])
        found = tuple(
            replace(one, parameters=_parameters(regression, one.law))
            for one in sketches(searches, DRAFTED_GAIN)
        )
        plain = every[0][1].mapped(noise.white).runs
        return Sketchbook(sketches=found, bound=estimate_bound(regression, plain, searches))


def _counted(one: Thinned, relations: WhitenedRelations) -> Array:
    """Whether each row of a run counts, shape (rows, 1)."""
    intervals = np.repeat(one.usable_intervals, len(relations.value))
    return np.concatenate([intervals, ~one.void])[:, None]


def _searches(every: Sequence[tuple[LawQuantity, LawRows]]) -> list[LawSearch]:
    """The search in each quantity."""
    before = every[0][1].null_loss()
    return [search(rows, one, before) for one, rows in every]


def _parameters(regression: BlockRegression, law: Law) -> dict[str, float]:
    """Values of the free parameters that the relations contain."""
    r = regression
    return {
        name: r.values[name] + (away + offset) * std
        for (name, std), away, offset in zip(
            r.stds.items(), law.nuisance, r.prior_offsets, strict=False
        )
    }


def sketches(searches: Sequence[LawSearch], least_gain: float) -> tuple[Sketch, ...]:
    """Sketch the best laws of these searches, each with its curve; the best one first.

    least_gain : held-out gain from which on a law is drafted [twice the log of the odds]
    """
    return tuple(_sketch(one, law) for one, law in _best_laws(searches, least_gain))


def _best_laws(searches: Sequence[LawSearch], least_gain: float) -> list[tuple[LawSearch, Law]]:
    """The best law, its shorter or longer form, and its alternatives, of all quantities.

    A short law and a long one that resemble each other are both tested: a simulation decides
    whether the further terms are worth it.
    """
    every = []
    for one in searches:
        nested = one.list_nested()
        every += [(one, chosen) for chosen in {nested[0], nested[-1], *one.singles()}]
    every = [pair for pair in every if pair[0].gain(pair[1]) >= least_gain]
    every.sort(key=lambda pair: -pair[0].score(pair[1]))
    found: list[tuple[LawSearch, Law]] = []
    for one, chosen in every:
        if one.score(chosen) < ALTERNATIVE_SHARE * every[0][0].score(every[0][1]):
            break
        law = one.law(chosen)
        alike = [other for _, other in found if law.resembles(other)]
        if all((len(law.terms) > 1) != (len(other.terms) > 1) for other in alike):
            found.append((one, law))
        if len(found) == MOST_LAWS:
            break
    return found


def _sketch(one: LawSearch, law: Law) -> Sketch:
    smooth = [state for term in law.terms for state in term.states if state.kind != "angle"]
    state = smooth[0] if smooth else one.quantity.states[0]
    return Sketch(law=law, curve=curve(one.rows, one.quantity, state))
