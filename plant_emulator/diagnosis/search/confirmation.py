"""Fits a hypothesis by simulation, from the linear estimate of its effects."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitValues
from plant_emulator.diagnosis.fitting.approach import (
    lead,
    let_go,
    nearest,
)
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.screening.promise import Start, starts_of
from plant_emulator.diagnosis.screening.scans import scan_sizes, scan_states
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

    starts : where a fit may begin near the data; led_from : those that are led, one or more
    lengths : of slopes nearby, see `Estimate.lengths`
    iterations : of each fit at most so many
    promised : predicted gains of the last effect by score
    led : the best fit along the measured outputs; None: not known
    """

    effects: tuple[str, ...]
    runs: tuple[int, ...]
    starts: tuple[Start, ...]
    led_from: tuple[Start, ...]
    lengths: Lengths = field(default_factory=dict)
    iterations: int = SETTINGS.leader_iterations
    promised: Mapping[str, float] = field(default_factory=dict)
    led: FitResult | None = None


def trial_of(promise: Promise, base: FitResult, runs: tuple[int, ...]) -> Trial:
    """The trial of one more effect on top of a fit."""
    starts, led_from = starts_of(promise, base)
    return Trial(
        effects=(*base.effects, promise.effect),
        runs=runs,
        starts=starts,
        led_from=led_from,
        lengths=base.lengths,
        promised=promise.gains,
    )


def lead_trial(model: Model, trial: Trial) -> tuple[Trial, FitResult]:
    """The trial with its best fit along the measured outputs, and that fit (a step)."""
    scanned = _with_scanned_sizes(model, trial)
    led = _lead(model, scanned)
    return replace(scanned, led=led), led


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
    there = (start,)
    again = replace(trial, starts=there, led_from=there, lengths=found.lengths, led=None)
    return min(found, fit_from_best_start(model, again), key=lambda one: one.cost)


def fit_from_best_start(model: Model, trial: Trial) -> FitResult:
    """Fit a hypothesis from the start that leaves least.

    Where all are far from the data, the best one along the measured outputs is let go, and is
    another start.
    """
    starts = [_values(trial, one) for one in trial.starts]
    known = [*starts, trial.led] if trial.led else starts
    # Of several effects one may be absent from a start that is near the data without it.
    far = NOISE_MEAN_SQUARE if len(trial.effects) > 1 else SUSPECT_MEAN_SQUARE
    near = nearest(model, known, trial.runs, far)
    if near is None:
        led = trial.led or _lead(model, trial)
        free = let_go(model, led, trial.runs, trial.iterations)
        near = nearest(model, [free, *known], trial.runs, np.inf) or free
    return fit(
        model,
        trial.effects,
        trial.runs,
        near.values,
        near.states,
        trial.iterations,
        lengths=near.lengths,
    )


def _lead(model: Model, trial: Trial) -> FitResult:
    """The best of the fits along the measured outputs from all starts that are led.

    What a start leaves before its fit, or after few iterations, does not tell how far it leads. A
    dead time that stands for a filter may leave less than the filter with the right dead time.
    """
    starts = [_values(trial, one) for one in trial.led_from]
    found = [lead(model, one, trial.runs, iterations=trial.iterations) for one in starts]
    return min(found, key=lambda one: one.cost)


def _with_scanned_sizes(model: Model, trial: Trial) -> Trial:
    """The trial with those sizes of the last effect scanned that have many narrow basins."""
    starts, led_from = (
        tuple(scan_sizes(model, trial.effects, trial.runs, one) for one in some)
        for some in (trial.starts, trial.led_from)
    )
    return replace(trial, starts=starts, led_from=led_from)


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
    trial = Trial(rest, asked.runs, starts=starts, led_from=starts, lengths=base.lengths)
    return fit_from_best_start(model, trial)


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
