"""The contest between effects: which one, fitted with everything that may drift, is needed.

 1. One converged fit without effects.
 2. For each effect its signature: the residual's change when the effect comes in at some size, all
    else as fitted; and what of that the drifting parameters cannot imitate (the part orthogonal to
    their tangents: Basseville and Nikiforov, INRIA RR-4438, 2002).
 3. A joint fit of drift and effect, started from the size whose signature explains most, the drift
    moved by what the linear picture says: of every effect a cheap first look, whose drift follows
    by secants; of the best a few full steps; of the best of these to convergence.
 4. Where the fit without effects leaves much, it may lie in a wrong valley, and mislead both the
    signature and the start: the joint fit then starts once more from the nominal parameters and
    the size that fits these best.
 5. What leaves more than noise starts again from a larger size, for the linear picture is wrong
    where drift has gone far to imitate the effect; and the best from some way off (3 times): where
    contact comes and goes, the cost is rough, and a fit may have stopped in a small hollow.
 6. The fit without effects starts again from every joint fit's drift: should it get as low, there
    was no effect, only a better valley.

Every step is a function of a model and plain data, so that steps run side by side on other
processes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.covariance import correlation_time, structure
from plant_emulator.diagnosis.signature import STATES, signs, sized, tried
from plant_emulator.estimation import Estimate, at, estimate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.diagnosis.signature import Signature
    from plant_emulator.estimation import Unknown

# Relative fall of the cost that ends a fit here: a few hundredths in units of chi squared.
SETTLED = 1e-6
# Steps of a first look, whose drift follows by secants, and the relative fall that ends it.
GLANCE, GLANCE_SETTLED = 10, 1e-4
# Steps of a fit that only has to show whether it is worth more: without and with states of its
# own, which make a long curved valley of the cost.
FEW, FEW_WITH_STATES = 8, 24
# The same from some way off, and how far off that is [standard errors].
FEW_SHAKEN, SHAKE = 12, 30.0
# The same from the nominal parameters, where a step goes far.
FEW_FAR, FEW_FAR_WITH_STATES = 4, 8
# Sizes that a start from the nominal parameters is tried at, in plausible sizes.
FAR_SIZES = (0.4, 1.0, 2.0)
# Mean square from which on a fit may lie in a wrong valley.
ASTRAY = 1.5
# A fit that is to be improved by starting again has to fall by more than this [chi squared].
WORTH = 1.0


@dataclass(frozen=True, kw_only=True)
class Point:
    """Where a joint fit has come to.

    values : parameters, sizes and shapes by name; states : of every run of the fit, by name
    cost : sum of squares with the priors; squares : of the residuals alone; samples : counted
    share : of the samples that are independent, from the residual's autocorrelation time
    errors : standard errors by name of `values`
    structure : of the residuals, beyond white noise, see `covariance.structure`
    """

    effects: tuple[str, ...]
    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]
    cost: float
    squares: float
    samples: int
    share: float
    errors: Mapping[str, float]
    converged: bool
    structure: float = 0.0

    @property
    def key(self) -> tuple[object, ...]:
        """The same for the same fit only."""
        return (self.effects, self.cost, *self.values.values())

    @property
    def chi_squared(self) -> float:
        """Mean square of the whitened residual; 1: only the noise is left."""
        return self.squares / self.samples


def template(model: Model, effects: Sequence[str], runs: Sequence[int]) -> list[Unknown]:
    """All unknowns of a joint fit: drift, effects, states of every run (numbered from 0)."""
    own = [model.candidates[name] for name in effects]
    states = (*model.states, *(u for c in own for u in c.states))
    shared = (*model.parameters, *(u for c in own for u in (*c.sizes, *c.shapes)))
    return [*shared, *(replace(u, run=k) for k in range(len(runs)) for u in states)]


def started(
    unknowns: Sequence[Unknown], values: Mapping[str, float], states: Sequence[Mapping[str, float]]
) -> list[Unknown]:
    """The unknowns, starting at these values where there are such, within their bounds."""
    wanted = [(values if u.run is None else states[u.run]).get(u.name, u.start) for u in unknowns]
    return [
        replace(u, start=float(np.clip(value, u.lower, u.upper)))
        for u, value in zip(unknowns, wanted, strict=True)
    ]


def fit(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
    iterations: int | None = None,
    near: Estimate | None = None,
) -> Point:
    """Joint fit of drift, states and these effects, from these values.

    near : see `estimate`'s `follow`; a first look only
    """
    unknowns = started(template(model, effects, runs), values, states)
    residuals = [model.residual(k, effects) for k in runs]
    settled = SETTLED if near is None else GLANCE_SETTLED
    found = estimate(unknowns, residuals, settled=settled, iterations=iterations, follow=near)
    return point(effects, found, len(runs))


def again(model: Model, effects: Sequence[str], runs: Sequence[int], start: Point) -> Point:
    """Joint fit with these effects from where another fit has come to."""
    return fit(model, effects, runs, start.values, start.states)


def linearised(model: Model, where: Point, runs: Sequence[int]) -> Estimate:
    """Residuals and Jacobians of a fit that has ended."""
    unknowns = started(template(model, where.effects, runs), where.values, where.states)
    return at(unknowns, [model.residual(k, where.effects) for k in runs])


def point(effects: Sequence[str], found: Estimate, runs: int) -> Point:
    """An estimate as plain data."""
    errors = zip(found.unknowns, found.z, found.standard_errors, strict=True)
    return Point(
        effects=tuple(effects),
        values=found.parameters(),
        states=tuple(found.states(k) for k in range(runs)),
        cost=found.cost + found.penalty,
        squares=found.cost,
        samples=found.samples,
        share=independent_share(found),
        errors={
            u.name: u.error(u.value(float(z)), float(e)) for u, z, e in errors if u.run is None
        },
        converged=found.converged,
        structure=sum(structure(channel) for run in found.residuals for channel in run),
    )


def independent_share(found: Estimate) -> float:
    """Share of the samples that are independent: the inverse of the mean autocorrelation time."""
    channels = [channel for residual in found.residuals for channel in residual]
    weight = np.array([np.count_nonzero(channel) for channel in channels], float)
    times = np.array([correlation_time(channel) for channel in channels])
    return float(weight.sum() / (weight * times).sum())


def null_fit(model: Model, runs: Sequence[int]) -> Point:
    """The fit without effects, from the model's own search; where that leaves much, from the
    nominal parameters as well.
    """
    found = fit(model, (), runs, *model.search(runs))
    if found.chi_squared <= ASTRAY:
        return found
    nominal = {u.name: u.prior for u in model.parameters}
    states = [model.start_states(k, (), nominal) for k in runs]
    return min(found, fit(model, (), runs, nominal, states), key=lambda p: p.cost)


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


def look(model: Model, effects: Sequence[str], runs: Sequence[int], start: Point) -> Point:
    """A few steps of a joint fit, from where another fit has come to."""
    with_states = any(model.candidates[name].states for name in effects)
    if not with_states:
        return fit(model, effects, runs, start.values, start.states, FEW)
    states = _scanned(model, effects, runs, start.values, start.states)
    return fit(model, effects, runs, start.values, states, FEW_WITH_STATES)


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
    """States of every run, each the best of some values while the others stay, two times over."""
    own = (*model.states, *(u for name in effects for u in model.candidates[name].states))
    found = []
    for k, state in zip(runs, states, strict=True):
        best = dict(state)
        for u in (*own, *own):
            trials = [{**best, u.name: value} for value in (best[u.name], *tried(u, STATES))]
            losses = [_loss(model, effects, [k], values, [trial]) for trial in trials]
            best = trials[int(np.argmin(losses))]
        found.append(best)
    return tuple(found)


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
    best = min(starts, key=lambda values: _loss(model, effects, runs, values, states))
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
