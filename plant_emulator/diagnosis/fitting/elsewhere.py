"""Joint fits that start from elsewhere than a signature: from some way off where another fit has
come to, in the place of its last effect, or from the nominal parameters.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import fit, joint_unknowns, linearise
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.fitting.signature import signs, values_at_size
from plant_emulator.diagnosis.fitting.valleys import best_states, loss_of, whole
from plant_emulator.estimation.robust_scan import cauchy_loss

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model

# Steps from some way off, how far off that is [standard errors], and at most [scales].
FEW_SHAKEN, SHAKE, FARTHEST = 12, 30.0, 1.0
# Values that each unknown is tried at before such steps, and how far off they go [prior deviations;
# parts of the value where there is no prior].
SIFTED, SIFT, SIFT_SIZE = 11, 1.0, 0.1
# What slopes are taken over in a search down a rough cost [norm of the change of the residual], and
# steps with each.
COARSE, FEW_COARSE = (100.0, 30.0, 10.0, 3.0), 8
# Steps from the nominal parameters, where each goes far; with states of the effect's own.
FEW_FAR, FEW_FAR_WITH_STATES = 4, 8
# Sizes in another's place, which follow that one's size.
PLACES = (0.1, 0.2, 0.4, 0.7, 1.0, 1.4, 2.0, 3.0)
# Sizes that a start from the nominal parameters is tried at, in plausible sizes.
FAR_SIZES = (0.25, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0)


def shaken(
    model: Model, effects: Sequence[str], runs: Sequence[int], start: FitResult, number: int
) -> FitResult:
    """A few steps of a joint fit from some way off where it has come to, each number another way.

    As far as SHAKE times the noise may have moved it, no further than what is known beforehand. One
    in three goes along the floor of its valley, drawn with the covariance that the fit would have
    then; the others move each unknown by itself, which leads out of it. Within the bounds: with a
    friction below zero a bench shakes, in steps of microseconds.
    """
    found = linearise(model, start, runs)
    reach = np.array([min(u.scaled_std, FARTHEST) for u in found.unknowns])
    draw = np.random.default_rng(number).standard_normal(len(reach))
    if number % 3 == 1:
        squares, axes = np.linalg.eigh(found.information / SHAKE**2 + np.diag(reach**-2.0))
        shift = axes @ (draw / np.sqrt(squares))
    else:
        own = np.array([u.run is not None for u in found.unknowns])
        shift = np.where(own, 0.0, draw * np.minimum(SHAKE * found.standard_errors, reach))
    moved, states = NuisanceSpace(found).shifted(shift, len(runs))
    if any(model.candidates[name].states for name in effects):
        states = [*best_states(model, effects, runs, moved, states, anew=effects)]
    return fit(model, effects, runs, moved, states, FEW_SHAKEN)


def smoothed(
    model: Model, effects: Sequence[str], runs: Sequence[int], start: FitResult
) -> FitResult:
    """A few steps of a joint fit from where another has come to, with slopes over wide differences
    first, then over smaller ones.

    Contact that comes and goes gives the cost a rough bottom, in whose hollows small differences
    end; wide ones see the valley (as implicit filtering does: C. T. Kelley, SIAM 2011).
    """
    best = start
    for difference in COARSE:
        found = fit(
            model, effects, runs, best.values, best.states, FEW_COARSE, difference=difference
        )
        best = min(best, found, key=lambda p: p.cost)
    return best


def sifted(
    model: Model, effects: Sequence[str], runs: Sequence[int], start: FitResult
) -> FitResult:
    """A few steps of a joint fit from where another has come to, each unknown moved to the best of
    some values while the others stay, two times over.

    By Cauchy's loss: contact that comes at the wrong time makes valleys of the squares, that
    a start from some way off seldom leaves where several unknowns have to go with each other.
    """
    values, states = dict(start.values), start.states
    for anew in (effects, ()):
        states = best_states(model, effects, runs, values, states, anew=anew)
        for u in (u for u in joint_unknowns(model, effects, runs) if u.run is None):
            own = values[u.name]
            far = SIFT * u.std if u.std is not None else SIFT_SIZE * abs(own)
            around = np.clip(np.linspace(own - far, own + far, SIFTED), u.lower, u.upper)
            trials = [{**values, u.name: value} for value in (own, *map(float, around))]
            values = min(trials, key=lambda v: loss_of(model, effects, runs, v, states))
    return fit(model, effects, runs, values, states, FEW_SHAKEN)


def in_place(
    model: Model, effect: str, found: FitResult, runs: Sequence[int], tangents: NuisanceSpace
) -> tuple[float, FitResult]:
    """A start with an effect in the place of a fit's last, at the size that fits best there, the
    drift as it is or moved to make up for the difference; and the loss there.

    tangents : of the drift there, see `vacated`
    """
    effects, candidate = (*found.effects[:-1], effect), model.candidates[effect]
    before = whole(model, found.effects, runs, found.values, found.states)
    place = vacated(model, found)
    own = {u.name: u.start for u in candidate.states}
    states = [{**state, **own} for state in place.states]
    tries = []
    for size in (sign * z for z in PLACES for sign in signs(candidate.sizes)):
        values = {**place.values, **values_at_size(candidate, size)}
        there = whole(model, effects, runs, values, states)
        tries.append((cauchy_loss(there), values, states))
        moved, after = tangents.shifted(tangents.projection(there - before), len(states))
        far = {**values, **moved}, [{**s, **t} for s, t in zip(states, after, strict=True)]
        tries.append((loss_of(model, effects, runs, *far), *far))
    loss, values, states = min(tries, key=lambda one: one[0])
    return loss, replace(found, effects=effects, values=values, states=tuple(states))


def vacated(model: Model, found: FitResult) -> FitResult:
    """Where a fit has come to, less its last effect."""
    last = model.candidates[found.effects[-1]]
    gone = {u.name for u in (*last.sizes, *last.shapes)}
    values = {name: value for name, value in found.values.items() if name not in gone}
    return replace(found, effects=found.effects[:-1], values=values)


def from_nominal(model: Model, effect: str, base: FitResult, runs: Sequence[int]) -> FitResult:
    """Joint fit of one more effect, a few steps a run: the drift from its nominal values, the
    effect from the size that fits them best.
    """
    effects = (*base.effects, effect)
    candidate = model.candidates[effect]
    nominal = {**base.values, **{u.name: u.prior for u in model.parameters}}
    own = {u.name: u.start for u in candidate.states}
    states = [{**state, **own} for state in base.states]
    starts = [
        {**nominal, **values_at_size(candidate, sign * size)}
        for size in FAR_SIZES
        for sign in signs(candidate.sizes)
    ]
    losses = np.array([loss_of(model, effects, runs, values, states) for values in starts])
    # A size at which nothing happens, as of a limit that is not reached, is no start.
    without = loss_of(model, base.effects, runs, nominal, base.states)
    losses[losses == without] = np.inf
    few = FEW_FAR_WITH_STATES if candidate.states else FEW_FAR
    return run_by_run(model, effects, runs, starts[int(np.argmin(losses))], few)


def run_by_run(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    few: int,
) -> FitResult:
    """Joint fit from values far off: the runs come in one by one, the nearest first, a few steps
    after each. A run with much contact, whose cost has many valleys, comes in when the others have
    brought the values near.
    """
    found: dict[int, Mapping[str, float]] = {}
    while True:
        waiting = {k: model.initial_states(k, effects, values) for k in runs if k not in found}
        losses = {k: loss_of(model, effects, [k], values, [one]) for k, one in waiting.items()}
        nearest = min(waiting, key=lambda k: losses[k])
        found[nearest] = waiting[nearest]
        used = [k for k in runs if k in found]
        reached = fit(model, effects, used, values, [found[k] for k in used], few)
        if len(used) == len(runs):
            return reached
        values, found = reached.values, dict(zip(used, reached.states, strict=True))
