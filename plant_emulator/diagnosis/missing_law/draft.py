"""From the runs and the fit without effects to the laws that are worth a contest.

The regression tells of every quantity which laws close the gap of runs that they were not fitted
to. The contest by simulation then decides among few of them (`contest`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
from plant_emulator.diagnosis.missing_law.curve import curve
from plant_emulator.diagnosis.missing_law.law_search import DRAFTED_GAIN, null_loss, search
from plant_emulator.diagnosis.missing_law.quantities import quantities

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.answer import Curve
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.missing_law.law_search import Law, Search
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording

# At most so many laws meet in a contest: each takes a fit a fold.
MOST_LAWS = 3
# Share of the best law's held-out gain from which on another law is a rival.
RIVAL_SHARE = 0.8


@dataclass(frozen=True, kw_only=True, eq=False)
class Sketch:
    """A law that is worth a contest.

    curve : the same quantity over the law's first state, without a formula
    """

    law: Law
    curve: Curve


def sketches(
    recordings: Sequence[Recording], parameters: ParameterSet, null: FitResult
) -> list[Sketch]:
    """Laws that are worth a contest, the best one first; empty where no law closes a gap.

    null : converged fit without effects; at least two recordings, because other runs judge
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        regression = BlockRegression(recordings, parameters, null)
        before = null_loss(regression)
        searches = [search(regression, one, before) for one in quantities(regression)]
        return [_sketch(regression, *pair) for pair in _contenders(searches)]


def _contenders(searches: Sequence[Search]) -> list[tuple[Search, tuple[int, ...]]]:
    """The best law, its shorter or longer form, and rivals, of all quantities."""
    every = []
    for one in searches:
        nested = one.nested()
        every += [(one, chosen) for chosen in {nested[0], nested[-1], *one.singles()}]
    every = [pair for pair in every if pair[0].gain(pair[1]) >= DRAFTED_GAIN]
    every.sort(key=lambda pair: -pair[0].score(pair[1]))
    found: list[tuple[Search, tuple[int, ...]]] = []
    for one, chosen in every:
        near = not found or one.score(chosen) >= RIVAL_SHARE * found[0][0].score(found[0][1])
        if near and all(_form(one, chosen) != _form(*other) for other in found):
            found.append((one, chosen))
        if len(found) == MOST_LAWS:
            break
    return found


def _form(one: Search, chosen: Sequence[int]) -> tuple[object, ...]:
    """What tells two laws apart: the quantity, and functions and states without their scales."""
    factors = {
        (factor.function, factor.state.name)
        for j in chosen
        for factor in one.terms[j].factors
        if factor.state.kind != "direction"
    }
    return (one.quantity.name, min(len(chosen), 2), frozenset(factors))


def _sketch(regression: BlockRegression, one: Search, chosen: tuple[int, ...]) -> Sketch:
    law = one.law(chosen)
    smooth = [state for term in law.terms for state in term.states if state.kind != "angle"]
    state = smooth[0] if smooth else one.quantity.states[0]
    return Sketch(law=law, curve=curve(regression, one.quantity, state))
