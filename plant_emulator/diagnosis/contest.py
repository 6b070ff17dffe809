"""The contest between effects: which one, fitted with everything that may drift, is needed.

 1. One converged fit without effects.
 2. For each effect its signature: the residual's change when the effect comes in at some size, all
    else as fitted; and what of that the drifting parameters cannot imitate (the part orthogonal to
    their tangents: Basseville and Nikiforov, INRIA RR-4438, 2002).
 3. A joint fit of drift and effect, started from the size whose signature explains most, the drift
    moved by what the linear picture says.
 4. Where the fit without effects leaves much, it may lie in a wrong valley, and mislead both the
    signature and the start: the joint fit then starts once more from the nominal parameters and
    the size that fits these best.
 5. The fit without effects starts again from every joint fit's drift: should it get as low, there
    was no effect, only a better valley.

Every step is a function of a model and plain data, so that steps run side by side on other
processes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.covariance import correlation_time
from plant_emulator.estimation import Estimate, at, estimate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.model import Candidate, Model
    from plant_emulator.estimation import Array, Unknown

# Relative fall of the cost that ends a fit here: a few hundredths in units of chi squared.
SETTLED = 1e-6
# Sizes at which a signature is tried, in plausible sizes.
SIZES = (0.03, 0.1, 0.3, 1.0, 2.0)
# Steps of a fit that only has to show whether it is worth more: without and with states of its
# own, which make a long curved valley of the cost.
FEW, FEW_WITH_STATES = 8, 24
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
) -> Point:
    """Joint fit of drift, states and these effects, from these values."""
    unknowns = started(template(model, effects, runs), values, states)
    residuals = [model.residual(k, effects) for k in runs]
    found = estimate(unknowns, residuals, settled=SETTLED, iterations=iterations)
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


@dataclass(frozen=True, kw_only=True)
class Signature:
    """What an effect does to the whitened residual of a fit that lacks it.

    start : where a joint fit may begin, by name; states : the same of every run
    norm : of the part that drift cannot imitate, at the plausible size
    raw : of the whole, at the plausible size
    gain : fall of the sum of squares that the linear picture expects at the best size
    tangent_gain : the same at whatever size, from the signature of the smallest
    imitated_by : the parameter that follows it most
    norms : of the part that drift cannot imitate, by size in plausible sizes, ascending
    direction : the part that drift cannot imitate over its norm, all runs and channels
    """

    effect: str
    start: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]
    norm: float
    raw: float
    gain: float
    tangent_gain: float
    norms: tuple[tuple[float, float], ...]
    imitated_by: str
    direction: Array


class Tangents:
    """The drift's tangent space at a fit, for removing from signatures what drift can imitate."""

    def __init__(self, found: Estimate) -> None:
        p = len(found.z)
        self.found = found
        self.residual = np.concatenate([r.ravel() for r in found.residuals])
        self._slopes = np.concatenate([j.reshape(-1, p) for j in found.jacobians])
        precision = np.diag([u.scaled_std**-2.0 for u in found.unknowns])
        self._inverse = np.linalg.pinv(found.information + precision, hermitian=True)

    def imitation(self, change: Array) -> Array:
        """Shift of z that follows a change of the residual best."""
        return np.asarray(-self._inverse @ (self._slopes.T @ change))

    def rest(self, change: Array) -> Array:
        """The change of the residual that remains when drift follows it."""
        return np.asarray(change + self._slopes @ self.imitation(change))

    def moved(self, shift: Array, runs: int) -> tuple[dict[str, float], list[dict[str, float]]]:
        """Values and states after a shift of z, within their bounds."""
        values: dict[str, float] = {}
        states: list[dict[str, float]] = [{} for _ in range(runs)]
        for u, z in zip(self.found.unknowns, self.found.z + shift, strict=True):
            value = u.value(float(np.clip(z, u.scaled(u.lower), u.scaled(u.upper))))
            (values if u.run is None else states[u.run])[u.name] = value
        return values, states


def signature(
    model: Model, name: str, where: Point, runs: Sequence[int], tangents: Tangents
) -> Signature | None:
    """The signature of an effect at a fit that lacks it; None: it changes nothing there."""
    trials = [
        _trial(model, name, where, runs, tangents, sign * size)
        for size in SIZES
        for sign in signs(model.candidates[name].sizes)
    ]
    moving = [trial for trial in trials if trial.norm > 1e-6]
    if not moving:
        return None
    best = max(moving, key=lambda trial: trial.gain)
    plausible = max((t for t in trials if abs(t.size) == 1.0), key=lambda t: t.norm)
    values, states = tangents.moved(tangents.imitation(best.change), len(runs))
    own = {u.name: u.start for u in model.candidates[name].states}
    names = [u.name for u in tangents.found.unknowns]
    follows = np.abs(tangents.imitation(plausible.change)) * _lengths(tangents.found)
    return Signature(
        effect=name,
        start={**values, **best.sizes},
        states=tuple({**state, **own} for state in states),
        norm=plausible.norm,
        raw=float(np.linalg.norm(plausible.change)),
        gain=best.gain,
        tangent_gain=max(_tangent_gain(t, tangents) for t in trials if abs(t.size) == SIZES[0]),
        norms=tuple((t.size, t.norm) for t in trials if t.size > 0.0),
        imitated_by=names[int(np.argmax(follows))],
        direction=plausible.rest / max(plausible.norm, 1e-12),
    )


def _tangent_gain(trial: _Trial, tangents: Tangents) -> float:
    """Fall of the sum of squares at the best multiple of a signature, 0 where that is negative."""
    along = min(0.0, float(trial.rest @ tangents.residual))
    return along**2 / max(trial.norm**2, 1e-12)


def _lengths(found: Estimate) -> Array:
    """Length of each column of the Jacobian: what a unit of z moves in the residual."""
    return np.asarray(np.sqrt(np.diag(found.information)))


@dataclass(frozen=True, kw_only=True)
class _Trial:
    size: float
    sizes: Mapping[str, float]
    change: Array
    rest: Array
    norm: float
    gain: float


def _trial(
    model: Model, name: str, where: Point, runs: Sequence[int], tangents: Tangents, size: float
) -> _Trial:
    """The effect at one size, in plausible sizes."""
    candidate = model.candidates[name]
    sizes = _sized(candidate, size)
    changed = _residual(model, candidate, where, runs, sizes)
    change = changed - tangents.residual
    rest = tangents.rest(change)
    after = tangents.residual + rest
    return _Trial(
        size=size,
        sizes=sizes,
        change=change,
        rest=rest,
        norm=float(np.linalg.norm(rest)),
        gain=float(tangents.residual @ tangents.residual - after @ after),
    )


def _residual(
    model: Model,
    candidate: Candidate,
    where: Point,
    runs: Sequence[int],
    sizes: Mapping[str, float],
) -> Array:
    """Residual of all runs with one more effect, all else as fitted."""
    effects = (*where.effects, candidate.name)
    own = {u.name: u.start for u in candidate.states}
    return np.concatenate(
        [
            model.residual(k, effects)({**where.values, **state, **own, **sizes}).ravel()
            for k, state in zip(runs, where.states, strict=True)
        ]
    )


def _sized(candidate: Candidate, size: float) -> dict[str, float]:
    """Sizes, in plausible sizes from neutral, and shapes of an effect."""
    sizes = {u.name: bounded(u, candidate.neutral[u.name], size) for u in candidate.sizes}
    return sizes | {u.name: u.start for u in candidate.shapes}


def signs(sizes: Sequence[Unknown]) -> tuple[float, ...]:
    """Both directions where the bounds allow an effect in both."""
    return (1.0, -1.0) if any(u.lower < 0.0 < u.upper for u in sizes) else (1.0,)


def bounded(unknown: Unknown, neutral: float, factor: float) -> float:
    """A size in plausible sizes from neutral, within its bounds."""
    value = neutral + factor * (unknown.start - neutral)
    return float(np.clip(value, unknown.lower, unknown.upper))


def joint(model: Model, found: Signature, base: Point, runs: Sequence[int]) -> Point:
    """Joint fit of one more effect, a few steps only: from its signature's start, or, where that
    leads nowhere, from the drift as it is.
    """
    effects = (*base.effects, found.effect)
    few = FEW_WITH_STATES if model.candidates[found.effect].states else FEW
    best = fit(model, effects, runs, found.start, found.states, few)
    if best.cost < base.cost - WORTH:
        return best
    own = {u.name: u.start for u in model.candidates[found.effect].states}
    states = [{**state, **own} for state in base.states]
    small = {**found.start, **base.values}
    return min(best, fit(model, effects, runs, small, states, few), key=lambda p: p.cost)


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
        {**nominal, **_sized(candidate, sign * size)}
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
