"""From where the joint fit of an effect starts, and how far it is followed at first.

A cost of many valleys and a rough bottom has no start that is always right; each of these has found
effects that the others missed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.contest import WORTH, Point, fit, template
from plant_emulator.diagnosis.signature import FAR, signs, sized
from plant_emulator.start_states import scanned

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.diagnosis.signature import Signature
    from plant_emulator.estimates import Estimate, Unknown

# Steps of a first look, whose drift follows by secants.
GLANCE = 10
# Steps of a fit that only has to show whether it is worth more: without and with states of its
# own, which make a long curved valley of the cost.
FEW, FEW_WITH_STATES = 8, 24
# Steps of a fit through where drift follows an effect along a curve.
PATIENT = 25
# The same from some way off, and how far off that is [standard errors].
FEW_SHAKEN, SHAKE = 12, 30.0
# The same from the nominal parameters, where a step goes far.
FEW_FAR, FEW_FAR_WITH_STATES = 4, 8
# How far sizes of many valleys are looked for, in plausible sizes.
WIDEST = 3.0
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


def _scanned(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> tuple[dict[str, float], ...]:
    """States of every run, each the best of some values while the others stay, two times over.

    Those of many narrow valleys are then tried together: a signature at a fit that lacks the effect
    may have found the wrong one.
    """
    of_effects = [u for name in effects for u in model.candidates[name].states]
    own = [u for u in (*model.states, *of_effects) if u.step is None]
    together = of_effects if any(u.step is not None for u in of_effects) else []
    found = []
    for k, state in zip(runs, states, strict=True):
        best = dict(state)
        for u in (*own, *own):
            trials = [{**best, u.name: value} for value in (best[u.name], *u.starts())]
            losses = [_loss(model, effects, [k], values, [trial]) for trial in trials]
            best = trials[int(np.argmin(losses))]
        found.append(_together(model, effects, k, values, best, together))
    return tuple(found)


def _together(
    model: Model,
    effects: Sequence[str],
    run: int,
    values: Mapping[str, float],
    state: Mapping[str, float],
    unknowns: Sequence[Unknown],
) -> dict[str, float]:
    """States of a run with these tried all together, or as they are where that is better."""
    residual = model.residual(run, effects)
    anew = scanned(lambda v: residual({**values, **v}), state, unknowns)
    return min(dict(state), anew, key=lambda s: _loss(model, effects, [run], values, [s]))


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


def from_nominal(model: Model, effect: str, base: Point, runs: Sequence[int]) -> Point:
    """Joint fit of one more effect, a few steps only: the drift from its nominal values, the effect
    from the size that fits them best.
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
    best = starts[int(np.argmin(losses))]
    found = [model.start_states(k, effects, best) for k in runs]
    few = FEW_FAR_WITH_STATES if candidate.states else FEW_FAR
    return fit(model, effects, runs, best, found, few)


def _loss(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> float:
    """Sum of log(1 + r^2): what lies far off counts, but little more than near."""
    return sum(
        float(np.sum(np.log1p(model.residual(k, effects)({**values, **state}) ** 2)))
        for k, state in zip(runs, states, strict=True)
    )
