"""Fits a hypothesis by simulation, from the linear estimate of its effects."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitValues
from plant_emulator.diagnosis.fitting.approach import (
    APPROACH_ITERATIONS,
    CORRECTION_INTERVALS,
    lead,
    lead_best,
    let_go,
    mean_square,
    nearest,
)
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.screening.promise import Start, starts_of
from plant_emulator.diagnosis.screening.scans import scan_sizes, scan_states
from plant_emulator.diagnosis.search.compensation import start_with_room
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.screening.promise import Promise
    from plant_emulator.estimation.unknowns import Lengths


@dataclass(frozen=True)
class Trial:
    """A hypothesis to fit: its effects, the runs, and where the fit may begin.

    further : starts for the case that all others are far from the data
    lengths : of slopes nearby, see `Estimate.lengths`
    iterations : of each fit at most so many; None: until it converges
    promised : predicted gains of the last effect by score
    led : the fit along the measured outputs from the best start; None: not known
    others : what a few iterations made of the other starts, the best first
    """

    effects: tuple[str, ...]
    runs: tuple[int, ...]
    starts: tuple[Start, ...]
    further: tuple[Start, ...] = ()
    lengths: Lengths = field(default_factory=dict)
    iterations: int | None = None
    promised: Mapping[str, float] = field(default_factory=dict)
    led: FitResult | None = None
    others: tuple[FitResult, ...] = ()


def trial_of(
    promise: Promise, base: FitResult, runs: tuple[int, ...], iterations: int | None
) -> Trial:
    """The trial of one more effect on top of a fit."""
    starts, further = starts_of(promise, base)
    return Trial(
        effects=(*base.effects, promise.effect),
        runs=runs,
        starts=starts,
        further=further,
        lengths=base.lengths,
        iterations=iterations,
        promised=promise.gains,
    )


def lead_start(model: Model, trial: Trial) -> tuple[Trial, FitResult]:
    """The trial with its best start led along the measured outputs, and that fit (a step)."""
    scanned = _with_scanned_sizes(model, trial)
    led, *others = _lead(model, scanned)
    return replace(scanned, led=led, others=tuple(others)), led


def lead_others(
    model: Model, pairs: tuple[tuple[Trial, FitResult], FitResult]
) -> tuple[Trial, FitResult]:
    """A trial of a first effect with more starts led along the measured outputs (a step).

    One start makes room for the effect (`compensation`). The others were tried for a few iterations
    only. These tell the best start where the effect is nearly absent from some: such a start leaves
    little more than the fit without the effect, and leads nowhere.

    pairs : the trial and its led fit, and the fit without effects along the measured outputs
    returns the trial, and the best fit
    """
    (trial, known), base = pairs
    room = _values(trial, start_with_room(model, known, trial.runs, base))
    iterations = trial.iterations or APPROACH_ITERATIONS
    found = [lead(model, one, trial.runs, iterations=iterations) for one in (room, *trial.others)]
    led = min((known, *found), key=lambda one: one.cost)
    return replace(trial, led=led, others=()), led


def confirm(model: Model, trial: Trial) -> FitResult:
    """Fit a hypothesis from its best start (a step).

    Where it is not led yet, sizes of the last effect with many narrow basins are scanned at its
    starts. Such states, and the angle of each run, are scanned once more where the fit leaves more
    than noise: until then the effect was missing.
    """
    if trial.led is None:
        trial = _with_scanned_sizes(model, trial)
    found = fit_from_best_start(model, trial)
    own = model.candidates[trial.effects[-1]].states
    scanned = any(u.step is not None or u.angle for u in own)
    if found.mean_square <= NOISE_MEAN_SQUARE or not scanned:
        return found
    start = scan_states(model, found, trial.runs)
    if start.states == found.states:
        return found
    again = replace(trial, starts=(start,), further=(), lengths=found.lengths, led=None)
    return min(found, fit_from_best_start(model, again), key=lambda one: one.cost)


def fit_from_best_start(model: Model, trial: Trial) -> FitResult:
    """Fit a hypothesis from its best start.

    Where all starts are far from the data, the linear estimate of a size says little, and the
    nominal parameters with the plausible size are one more start. A set of effects is also fitted
    from its starts as they are, which are hardly worse than the smaller set.
    """
    starts = [_values(trial, one) for one in trial.starts]
    several = len(trial.effects) > 1
    known = [*starts, trial.led] if trial.led else starts
    near = nearest(model, known, trial.runs, _far(trial))
    if near is None:
        led = trial.led or _lead(model, trial)[0]
        near = let_go(model, led, trial.runs, trial.iterations or APPROACH_ITERATIONS)
    own = starts[-1]
    found = [
        fit(
            model,
            trial.effects,
            trial.runs,
            one.values,
            one.states,
            trial.iterations,
            lengths=one.lengths,
        )
        for one in ([near, own] if several and near is not own else [near])
    ]
    return min(found, key=lambda one: one.cost)


def _far(trial: Trial) -> float:
    """Mean square above which a start is far from the data."""
    return NOISE_MEAN_SQUARE if len(trial.effects) > 1 else SUSPECT_MEAN_SQUARE


def _lead(model: Model, trial: Trial) -> list[FitResult]:
    """The fit along the measured outputs from the best start, and the others; see `lead_best`.

    It is sought among those that leave least so as they are, and the plausible one.
    """
    observer = model.observer(CORRECTION_INTERVALS[0])
    told = [_values(trial, one) for one in (*trial.starts, *trial.further)]
    told.sort(key=lambda one: mean_square(observer, one, trial.runs))
    plausible = [_values(trial, _plausible(model, trial, one)) for one in trial.starts[:1]]
    starts = [*told[: SETTINGS.most_started], *plausible]
    iterations = trial.iterations or APPROACH_ITERATIONS
    return lead_best(model, starts, trial.runs, iterations, _far(trial))


def _with_scanned_sizes(model: Model, trial: Trial) -> Trial:
    """The trial with those sizes of the last effect scanned that have many narrow basins."""
    starts, further = (
        tuple(scan_sizes(model, trial.effects, trial.runs, one) for one in some)
        for some in (trial.starts, trial.further)
    )
    return replace(trial, starts=starts, further=further)


@dataclass(frozen=True)
class Reduction:
    """A fit, and one of its effects to do without."""

    base: FitResult
    runs: tuple[int, ...]
    effect: str


def reduce(model: Model, asked: Reduction) -> FitResult:
    """Fit a set again without one of its effects (a step).

    One start has the values of the set as they are, another those that its slopes tell where the
    effect is absent: an effect may have bent the parameters together with it.
    """
    base = asked.base
    rest = tuple(name for name in base.effects if name != asked.effect)
    # A size that is not neutral would keep the effect in the simulation of a start.
    values = {**base.values, **model.candidates[asked.effect].neutral}
    starts = (_absent(model, asked), Start(values=values, states=base.states))
    iterations = SETTINGS.leader_iterations
    return fit_from_best_start(model, Trial(rest, asked.runs, starts, (), base.lengths, iterations))


def _absent(model: Model, asked: Reduction) -> Start:
    """The least sum of squares with the effect's sizes at neutral, by the slopes at the fit.

    The fit is the least of its own sum: its gradient is that of contact, which is not smooth.
    Shapes and states of the effect stay: they mean nothing where the effect is absent.
    """
    candidate = model.candidates[asked.effect]
    near = linearise(model, asked.base, asked.runs)
    own = {u.name for u in (*candidate.sizes, *candidate.shapes, *candidate.states)}
    free = np.array([u.name not in own for u in near.unknowns])
    sizes = candidate.neutral
    change = np.array(
        [
            u.scaled(sizes[u.name]) - z if u.name in sizes else 0.0
            for u, z in zip(near.unknowns, near.z, strict=True)
        ]
    )
    precision = np.array([u.scaled_std**-2.0 for u in near.unknowns])
    curvature = near.information + np.diag(precision)
    # A state that no sample shows has no curvature, and stays.
    step, *_ = np.linalg.lstsq(curvature[np.ix_(free, free)], (curvature @ change)[free])
    change[free] -= step
    lower = [u.scaled(u.lower) for u in near.unknowns]
    upper = [u.scaled(u.upper) for u in near.unknowns]
    there = replace(near, z=np.clip(near.z + change, lower, upper))
    states = tuple(there.states(k) for k in range(len(asked.runs)))
    return Start(values=there.parameters(), states=states)


def without_effects(model: Model, pair: tuple[FitResult, Reduction]) -> FitResult:
    """The fit without effects, anew from one with an effect whose values leave less (a step).

    Far from the data a fit may end in a local minimum. The freedom of any effect leads out of it.

    pair : the fit without effects, and the reduction of the other fit to none
    """
    known, asked = pair
    absent = _absent(model, asked)
    starts = [
        FitValues(effects=(), values=absent.values, states=absent.states, lengths=known.lengths),
        known.moved_to(asked.base),
    ]
    near = nearest(model, starts, asked.runs, known.mean_square)
    if near is None:
        return known
    return fit(model, (), asked.runs, near.values, near.states, lengths=known.lengths)


def _values(trial: Trial, start: Start) -> FitValues:
    return FitValues(
        effects=trial.effects, values=start.values, states=start.states, lengths=trial.lengths
    )


def _plausible(model: Model, trial: Trial, start: Start) -> Start:
    """The nominal parameters with the plausible size of the last effect, in the start's states.

    The size is on the start's side of neutral.
    """
    candidate = model.candidates[trial.effects[-1]]
    neutral = candidate.neutral
    sides = [
        (start.values[u.name] - neutral[u.name]) * (u.start - neutral[u.name])
        for u in candidate.sizes
    ]
    size = -1.0 if sum(sides) < 0.0 else 1.0
    values = {**start.values, **model.nominal(trial.runs), **values_at_size(candidate, size)}
    return replace(start, values=values)
