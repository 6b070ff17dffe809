"""The hypothesis test of drafted laws: joint fits, and predictions of held-out runs.

Every draft is an effect of the model by now. A fit starts where the regression with the law lies,
and from the nominal parameters: the fit without effects has bent the parameters to the gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.joint_fit import TRIAL_ITERATIONS, fit, fit_from
from plant_emulator.diagnosis.prediction.gap import (
    Fold,
    block_lengths,
    closed_fraction,
    closed_fraction_interval,
    measure_gap,
    predict,
)
from plant_emulator.diagnosis.prediction.trace import traces

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.prediction.held_out import Plan
    from plant_emulator.diagnosis.prediction.trace import Trace


# Share of the gap that each term of a law has to close more than a law without the term.
WORTH_A_TERM = 0.02


@dataclass(frozen=True, kw_only=True)
class DraftedLaw:
    """A drafted law that is tested against the others.

    effect : name of the effect; values : parameters that the regression with the law tells [SI]
    null : fit without effects; runs : that it was fitted to
    """

    effect: str
    values: Mapping[str, float]
    null: FitResult
    runs: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class LawResult:
    """A drafted law after the test.

    fit : joint fit; gain : share of the held-out gap that the draft closes [1], None: there is none
    interval : 95 % interval of the gain
    traces : held-out runs, measured and predicted without and with the draft
    """

    effect: str
    fit: FitResult
    gain: float | None
    interval: tuple[float, float] | None
    traces: tuple[Trace, ...]

    def is_draft(self, terms: int) -> bool:
        """Whether a law of so many terms closes a part of the gap for certain, and is worth it."""
        if self.gain is None or self.interval is None:
            return False
        return self.interval[0] > 0.0 and self.gain > WORTH_A_TERM * terms


def fit_law(model: Model, law: DraftedLaw) -> FitResult:
    """Fit a draft to all runs from its starts (a task)."""
    nominal = model.nominal(law.runs)
    starts = [{**law.null.values, **law.values}, {**law.null.values, **nominal}]
    trials = [_fit_from_start(model, law, start) for start in starts]
    best = min(trials, key=lambda found: found.cost)
    return best if best.converged else fit_from(model, (law.effect,), law.runs, best)


def _fit_from_start(model: Model, law: DraftedLaw, start: Mapping[str, float]) -> FitResult:
    candidate = model.candidates[law.effect]
    own = {u.name: u.start for u in (*candidate.sizes, *candidate.shapes)}
    known = {name: value for name, value in start.items() if name in law.null.values}
    values = {**known, **own}
    effects = (law.effect,)
    states = [model.initial_states(run, effects, values) for run in law.runs]
    return fit(model, effects, law.runs, values, states, TRIAL_ITERATIONS)


def compare_laws(runner: TaskRunner, plan: Plan, laws: Sequence[DraftedLaw]) -> list[LawResult]:
    """Fit every draft, and predict the held-out runs with and without it."""
    fits = list(runner.map(fit_law, laws))
    null = laws[0].null
    folds = [
        _fold(plan, start, fitted, predicted)
        for start in (null, *fits)
        for fitted, predicted in plan.folds
    ]
    found = list(runner.map(predict, folds))
    count = len(plan.folds)
    parts = [found[k : k + count] for k in range(0, len(found), count)]
    held_out = [runner.model.runs[run] for _, predicted in plan.folds for run in predicted]
    lengths = block_lengths(parts[0])
    gaps = [measure_gap(held_out, part, lengths) for part in parts]
    return [
        LawResult(
            effect=law.effect,
            fit=one,
            gain=closed_fraction(gaps[0], gap),
            interval=closed_fraction_interval(gaps[0], gap),
            traces=traces(held_out, parts[0], part),
        )
        for law, one, gap, part in zip(laws, fits, gaps[1:], parts[1:], strict=True)
    ]


def _fold(
    plan: Plan, start: FitResult, fitted: tuple[int, ...], predicted: tuple[int, ...]
) -> Fold:
    states = tuple(start.states[plan.fitted.index(run)] for run in fitted)
    return Fold(
        fitted=fitted,
        predicted=predicted,
        start=replace(start, states=states),
        as_fitted=plan.as_fitted,
    )
