"""From where the joint fit of an effect starts, and how far it is followed at first.

A cost of many valleys and a rough bottom has no start that is always right; each of these has found
effects that the others missed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.contest import WORTH, Point, fit, template
from plant_emulator.diagnosis.signature import FAR, signs, sized

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.diagnosis.signature import Signature
    from plant_emulator.diagnosis.tangents import Tangents
    from plant_emulator.estimates import Array, Estimate

# Steps of a first look, whose drift follows by secants.
GLANCE = 10
# Steps of a fit that only has to show whether it is worth more: without and with states of its
# own, which make a long curved valley of the cost.
FEW, FEW_WITH_STATES = 8, 24
# Steps of a fit through where drift follows an effect along a curve.
PATIENT = 25
# The same from some way off, and how far off that is [standard errors].
FEW_SHAKEN, SHAKE = 12, 30.0
# Values that each unknown is tried at before such steps, and how far off they go [prior deviations;
# parts of the value where there is no prior].
SIFTED, SIFT, SIFT_SIZE = 11, 1.0, 0.1
# The same from the nominal parameters, where a step goes far.
FEW_FAR, FEW_FAR_WITH_STATES = 4, 8
# How far sizes of many valleys are looked for, in plausible sizes.
WIDEST = 3.0
# Sizes in another's place, which follow that one's size.
PLACES = (0.1, 0.2, 0.4, 0.7, 1.0, 1.4, 2.0, 3.0)
# Sizes that a start from the nominal parameters is tried at, in plausible sizes.
FAR_SIZES = (0.25, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0)


def glance(
    model: Model, found: Signature, base: Point, runs: Sequence[int], near: Estimate
) -> Point:
    """A first look at the joint fit of one more effect, from its signature's start, or, where that
    leads nowhere, from the drift as it is.

    near : the base's estimate; the drift's slopes follow from its own, only the effect's are
        simulated
    """
    effects = (*base.effects, found.effect)
    best = fit(model, effects, runs, found.start, found.states, GLANCE, near)
    if best.cost < base.cost - WORTH:
        return best
    states = [{**own, **state} for own, state in zip(found.states, base.states, strict=True)]
    small = {**found.start, **base.values}
    other = fit(model, effects, runs, small, states, GLANCE, near)
    return min(best, other, key=lambda p: p.cost)


def glance_far(
    model: Model, found: Signature, base: Point, runs: Sequence[int], near: Estimate
) -> Point | None:
    """The same from a larger size; None where the signature has none."""
    if found.far is None:
        return None
    return fit(model, (*base.effects, found.effect), runs, *found.far, GLANCE, near)


def patient(model: Model, found: Signature, base: Point, runs: Sequence[int]) -> Point:
    """The joint fit of one more effect from a size on either side, the drift as it is, and with
    steps enough to come through where drift follows the effect along a curve.
    """
    candidate = model.candidates[found.effect]
    own = {u.name for u in candidate.states}
    states = [
        {**state, **{name: value for name, value in more.items() if name in own}}
        for state, more in zip(base.states, found.states, strict=True)
    ]
    effects = (*base.effects, found.effect)
    tries = [
        fit(model, effects, runs, {**base.values, **sized(candidate, sign * FAR)}, states, PATIENT)
        for sign in signs(candidate.sizes)
    ]
    return min(tries, key=lambda p: p.cost)


def look(model: Model, effects: Sequence[str], runs: Sequence[int], start: Point) -> Point:
    """A few steps of a joint fit, from where another fit has come to."""
    with_states = any(model.candidates[name].states for name in effects)
    if not with_states:
        return fit(model, effects, runs, start.values, start.states, FEW)
    states = _scanned(model, effects, runs, start.values, start.states)
    values = _sizes_scanned(model, effects, runs, start.values, states)
    return fit(model, effects, runs, values, states, FEW_WITH_STATES)


def shaken(
    model: Model, effects: Sequence[str], runs: Sequence[int], start: Point, number: int
) -> Point:
    """A few steps of a joint fit from some way off where it has come to, each number another way.

    As far as SHAKE standard errors, no further than a prior deviation.
    """
    random = np.random.default_rng(number)
    moved = dict(start.values)
    for u in template(model, effects, runs):
        if u.run is None:
            far = min(SHAKE * start.errors[u.name], u.std or abs(moved[u.name]))
            moved[u.name] += far * float(random.standard_normal())
    states = start.states
    if any(model.candidates[name].states for name in effects):
        states = _scanned(model, effects, runs, moved, states)
    return fit(model, effects, runs, moved, states, FEW_SHAKEN)


def sifted(model: Model, effects: Sequence[str], runs: Sequence[int], start: Point) -> Point:
    """A few steps of a joint fit from where another has come to, each unknown moved to the best of
    some values while the others stay, two times over.

    By a loss that forgives: contact that comes at the wrong time makes valleys of the squares, that
    a start from some way off seldom leaves where several unknowns have to go with each other.
    """
    values, states = dict(start.values), start.states
    for _ in range(2):
        states = _scanned(model, effects, runs, values, states)
        for u in (u for u in template(model, effects, runs) if u.run is None):
            own = values[u.name]
            far = SIFT * u.std if u.std is not None else SIFT_SIZE * abs(own)
            around = np.clip(np.linspace(own - far, own + far, SIFTED), u.lower, u.upper)
            trials = [{**values, u.name: value} for value in (own, *map(float, around))]
            losses = [_loss(model, effects, runs, trial, states) for trial in trials]
            values = trials[int(np.argmin(losses))]
    return fit(model, effects, runs, values, states, FEW_SHAKEN)


def _scanned(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> tuple[dict[str, float], ...]:
    """States of every run, each the best of some values while the others stay, two times over.

    One of many narrow valleys is where its signature has found it, and stays.
    """
    every = (*model.states, *(u for name in effects for u in model.candidates[name].states))
    own = [u for u in every if u.step is None]
    found = []
    for k, state in zip(runs, states, strict=True):
        best = dict(state)
        for u in (*own, *own):
            trials = [{**best, u.name: value} for value in (best[u.name], *u.starts())]
            losses = [_loss(model, effects, [k], values, [trial]) for trial in trials]
            best = trials[int(np.argmin(losses))]
        found.append(best)
    return tuple(found)


def _sizes_scanned(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> dict[str, float]:
    """The values, sizes of many valleys the best of many while all else stays."""
    best = dict(values)
    for candidate in (model.candidates[name] for name in effects):
        for u in candidate.sizes:
            if u.step is None:
                continue
            neutral = candidate.neutral[u.name]
            sizes = np.arange(neutral, neutral + WIDEST * (u.start - neutral), u.step)
            trials = [{**best, u.name: float(size)} for size in (best[u.name], *sizes)]
            losses = [_loss(model, effects, runs, trial, states) for trial in trials]
            best = trials[int(np.argmin(losses))]
    return best


def in_place(
    model: Model, effect: str, found: Point, runs: Sequence[int], tangents: Tangents
) -> tuple[float, Point]:
    """A start with an effect in the place of a fit's last, at the size that fits best there, the
    drift as it is or moved to make up for the difference; and the loss there.

    tangents : of the drift there, see `vacated`
    """
    effects, candidate = (*found.effects[:-1], effect), model.candidates[effect]
    before = _whole(model, found.effects, runs, found.values, found.states)
    place = vacated(model, found)
    own = {u.name: u.start for u in candidate.states}
    states = [{**state, **own} for state in place.states]
    tries = []
    for size in (sign * z for z in PLACES for sign in signs(candidate.sizes)):
        values = {**place.values, **sized(candidate, size)}
        there = _whole(model, effects, runs, values, states)
        tries.append((_forgiven(there), values, states))
        moved, after = tangents.moved(tangents.imitation(there - before), len(states))
        far = {**values, **moved}, [{**s, **t} for s, t in zip(states, after, strict=True)]
        tries.append((_loss(model, effects, runs, *far), *far))
    loss, values, states = min(tries, key=lambda one: one[0])
    return loss, replace(found, effects=effects, values=values, states=tuple(states))


def vacated(model: Model, found: Point) -> Point:
    """Where a fit has come to, less its last effect."""
    last = model.candidates[found.effects[-1]]
    gone = {u.name for u in (*last.sizes, *last.shapes)}
    values = {name: value for name, value in found.values.items() if name not in gone}
    return replace(found, effects=found.effects[:-1], values=values)


def _whole(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> Array:
    """Residual of all runs."""
    every = [
        model.residual(k, effects)({**values, **state})
        for k, state in zip(runs, states, strict=True)
    ]
    return np.concatenate([residual.ravel() for residual in every])


def from_nominal(model: Model, effect: str, base: Point, runs: Sequence[int]) -> Point:
    """Joint fit of one more effect, a few steps a run: the drift from its nominal values, the
    effect from the size that fits them best.
    """
    effects = (*base.effects, effect)
    candidate = model.candidates[effect]
    nominal = {**base.values, **{u.name: u.prior for u in model.parameters}}
    own = {u.name: u.start for u in candidate.states}
    states = [{**state, **own} for state in base.states]
    starts = [
        {**nominal, **sized(candidate, sign * size)}
        for size in FAR_SIZES
        for sign in signs(candidate.sizes)
    ]
    losses = np.array([_loss(model, effects, runs, values, states) for values in starts])
    # A size at which nothing happens, as of a limit that is not reached, is no start.
    without = _loss(model, base.effects, runs, nominal, base.states)
    losses[losses == without] = np.inf
    few = FEW_FAR_WITH_STATES if candidate.states else FEW_FAR
    return run_by_run(model, effects, runs, starts[int(np.argmin(losses))], few)


def run_by_run(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    few: int,
) -> Point:
    """Joint fit from values far off: the runs come in one by one, the nearest first, a few steps
    after each. A run with much contact, whose cost has many valleys, comes in when the others have
    brought the values near.
    """
    found: dict[int, Mapping[str, float]] = {}
    while True:
        waiting = {k: model.start_states(k, effects, values) for k in runs if k not in found}
        losses = {k: _loss(model, effects, [k], values, [one]) for k, one in waiting.items()}
        nearest = min(waiting, key=lambda k: losses[k])
        found[nearest] = waiting[nearest]
        used = [k for k in runs if k in found]
        reached = fit(model, effects, used, values, [found[k] for k in used], few)
        if len(used) == len(runs):
            return reached
        values, found = reached.values, dict(zip(used, reached.states, strict=True))


def _loss(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> float:
    """Loss of all runs that forgives."""
    return _forgiven(_whole(model, effects, runs, values, states))


def _forgiven(residual: Array) -> float:
    """Sum of log(1 + r^2): what lies far off counts, but little more than near."""
    return float(np.sum(np.log1p(residual**2)))
