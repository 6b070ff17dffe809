"""The hypothesis test of drafted laws: joint fits, and predictions of held-out runs.

Every draft is an effect of the model by now. A fit starts where the regression with the law lies,
with the states of the fit without effects, and from the nominal parameters: the fit without effects
may have bent parameters and states to the gap. A start that leaves far more than no law at all is
none: far from the data a regression may tell a law that makes the machine unstable. A few rough
iterations tell the better start. A law that explains no part of the runs that it is fitted to
predicts none of the others, and is not followed further. The shares count in the noise that the
best draft leaves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.execution.pool import build_model
from plant_emulator.diagnosis.fitting.fit_steps import refit
from plant_emulator.diagnosis.fitting.joint_fit import fit, fit_from
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.prediction.gap import (
    Fold,
    block_lengths,
    closed_fraction,
    closed_fraction_interval,
    measure_gap,
    predict,
)
from plant_emulator.diagnosis.prediction.trace import traces
from plant_emulator.diagnosis.search.logged_noise import WhitenedRecipe, estimate_noise

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import MeasuredRun, Model
    from plant_emulator.diagnosis.prediction.gap import Prediction
    from plant_emulator.diagnosis.prediction.held_out import Plan
    from plant_emulator.diagnosis.prediction.trace import Trace


# Share of the gap that each term of a law has to close more than a law without the term.
WORTH_A_TERM = 0.02
# Share of what the best law explains from which on another law is followed.
RIVAL_SHARE = 0.5
# Times the squares that the fit without a law leaves, up to which a start is one.
FAR_OFF = 2.0
# Iterations after which a start shows whether the law explains a part of the runs.
ROUGH_ITERATIONS = 4


@dataclass(frozen=True, kw_only=True)
class DraftedLaw:
    """A drafted law that is tested against the others.

    effect : name of the effect; values : parameters that the regression with the law tells [SI]
    null : fit without effects; runs : that it was fitted to
    states : what the regression tells of the law's states in each of these runs, by their names in
        the effect; empty: nothing
    """

    effect: str
    values: Mapping[str, float]
    null: FitResult
    runs: tuple[int, ...]
    states: Sequence[Mapping[str, float]] = ()


@dataclass(frozen=True, kw_only=True)
class LawResult:
    """A drafted law after the test.

    fit : joint fit; gain : share of the held-out gap that the draft closes [1]
    gain None : there is no gap, or the law explains too little of the runs that it was fitted to
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


def try_law(model: Model, law: DraftedLaw) -> FitResult:
    """Fit a draft roughly to all runs, and give the better one of its starts (a task).

    Where there is no start, the fit without effects is given: such a law explains nothing.
    """
    nominal = {**law.null.values, **model.nominal(law.runs)}
    told = {**law.null.values, **law.values}
    starts = [(told, law.null.states), (nominal, [{} for _ in law.runs])]
    limit = FAR_OFF * law.null.sum_of_squares
    # A law that no regression told begins at its plausible size, whatever that leaves.
    trials = [
        _fit_from_start(model, law, values, states)
        for values, states in starts
        if not law.values or _squares_at(model, law, values) < limit
    ]
    return min(trials, key=lambda found: found.cost, default=law.null)


def finish_law(model: Model, trial: tuple[DraftedLaw, FitResult]) -> FitResult:
    """Fit a draft to all runs from a trial (a task)."""
    law, found = trial
    return fit_from(model, (law.effect,), law.runs, found)


def explains(found: FitResult, null: FitResult) -> bool:
    """Whether a fit with a law leaves a worthwhile part less than the fit without one."""
    return null.mean_square - found.mean_square > WORTH_A_TERM * max(0.0, null.mean_square - 1.0)


def laws_to_follow(trials: Sequence[FitResult], null: FitResult) -> list[bool]:
    """Which trials explain the runs, and enough beside the best one."""
    most = null.mean_square - min(one.mean_square for one in trials)
    return [
        explains(one, null) and null.mean_square - one.mean_square >= RIVAL_SHARE * most
        for one in trials
    ]


def _squares_at(model: Model, law: DraftedLaw, start: Mapping[str, float]) -> float:
    """Sum of squares that a start leaves in the states of the fit without effects.

    To scan for the states of a run would take long where the law makes the machine unstable.
    """
    values, phases = _of_law(model, law, start)
    own = {u.name: u.start for u in model.candidates[law.effect].states}
    total = 0.0
    for run, known, told in zip(law.runs, law.null.states, phases, strict=True):
        residual = model.residual(run, (law.effect,))({**values, **own, **known, **told})
        total += float(np.sum(residual**2))
    return total


def _fit_from_start(
    model: Model,
    law: DraftedLaw,
    start: Mapping[str, float],
    known_states: Sequence[Mapping[str, float]],
) -> FitResult:
    """A few iterations; known_states : of each run at the start, others follow from the values."""
    values, phases = _of_law(model, law, start)
    effects = (law.effect,)
    states = [
        {**model.initial_states(run, effects, values), **known, **told}
        for run, known, told in zip(law.runs, known_states, phases, strict=True)
    ]
    return fit(model, effects, law.runs, values, states, ROUGH_ITERATIONS)


def _of_law(
    model: Model, law: DraftedLaw, start: Mapping[str, float]
) -> tuple[dict[str, float], list[dict[str, float]]]:
    """Values with the law at a start, and the law's states of each run as far as they are told."""
    candidate = model.candidates[law.effect]
    own = {u.name: u.start for u in (*candidate.sizes, *candidate.shapes)}
    known = {name: value for name, value in start.items() if name in law.null.values}
    told = [
        {f"{law.effect}_{name}": value for name, value in phases.items()}
        for phases in law.states or [{} for _ in law.runs]
    ]
    return {**known, **own}, told


def compare_laws(runner: TaskRunner, plan: Plan, laws: Sequence[DraftedLaw]) -> list[LawResult]:
    """Fit every draft, and predict the held-out runs with and without those that explain."""
    null = laws[0].null
    trials = list(runner.map(try_law, laws))
    chosen = laws_to_follow(trials, null)
    pairs = [
        pair for pair, follow in zip(zip(laws, trials, strict=True), chosen, strict=True) if follow
    ]
    fits = list(runner.map(finish_law, pairs))
    if fits:
        runner, (null, *fits) = _in_logged_noise(runner, (null, *fits))
    folds = [
        _fold(plan, start, fitted, predicted)
        for start in ((null, *fits) if fits else ())
        for fitted, predicted in plan.folds
    ]
    found = list(runner.map(predict, folds))
    count = len(plan.folds)
    parts = [found[k : k + count] for k in range(0, len(found), count)]
    held_out = [runner.model.runs[run] for _, predicted in plan.folds for run in predicted]
    finished = iter(zip(fits, parts[1:], strict=True))
    return [
        _result(law, *next(finished), held_out, parts[0])
        if follow
        else LawResult(effect=law.effect, fit=trial, gain=None, interval=None, traces=())
        for law, trial, follow in zip(laws, trials, chosen, strict=True)
    ]


def _in_logged_noise(
    runner: TaskRunner, fits: Sequence[FitResult]
) -> tuple[TaskRunner, list[FitResult]]:
    """The runner and the fits in the noise that the best fit leaves, if it is not as declared.

    Noise that follows a misfit would hide the gap: what no sensor has is none.
    """
    best = min(fits, key=lambda one: one.cost)
    (noise,) = runner.map(estimate_noise, [Task(base=best, runs=runner.runs)])
    if noise.plain or not all(one.of_sensor for one in noise.channels.values()):
        return runner, list(fits)
    recipe = WhitenedRecipe(runner.recipe, noise)
    own = replace(runner, recipe=recipe, model=build_model(recipe))
    return own, list(own.map(refit, [Task(base=one, runs=own.runs) for one in fits]))


def _result(
    law: DraftedLaw,
    fitted: FitResult,
    after: Sequence[Prediction],
    held_out: Sequence[MeasuredRun],
    before: Sequence[Prediction],
) -> LawResult:
    lengths = block_lengths(before)
    without, gap = (measure_gap(held_out, part, lengths) for part in (before, after))
    return LawResult(
        effect=law.effect,
        fit=fitted,
        gain=closed_fraction(without, gap),
        interval=closed_fraction_interval(without, gap),
        traces=traces(held_out, before, after),
    )


def _fold(
    plan: Plan, start: FitResult, fitted: tuple[int, ...], predicted: tuple[int, ...]
) -> Fold:
    return Fold(
        fitted=fitted,
        predicted=predicted,
        start=start.of_runs([plan.fitted.index(run) for run in fitted]),
        as_fitted=plan.as_fitted,
    )
