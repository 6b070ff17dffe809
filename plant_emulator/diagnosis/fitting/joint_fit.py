"""The contest between effects: which one, fitted with everything that may drift, is needed.

 1. One converged fit without effects. Where it leaves much and some of the runs need no effect,
    steps 2 and 3 first from the drift of those alone, which no effect has led astray; the same from
    the fit to all only where none explains half of what the others show there.
 2. For each effect its signature: the residual's change when the effect comes in at some size, all
    else as fitted; and what of that the drifting parameters cannot imitate (the part orthogonal to
    their tangents: Basseville and Nikiforov, INRIA RR-4438, 2002).
 3. A joint fit of drift and effect, started from the size whose signature explains most, the drift
    moved by what the linear picture says: of every effect a cheap first look, whose drift follows
    by secants; of the best a few full steps; of the best of these to convergence.
 4. Where none closes much, the signature and the start mislead: drift has gone far to imitate the
    effect, and the way back is rough, since contact comes and goes. All that could close the gap
    then start from a larger size, with slopes over wide differences first; or, where so much is
    left that the drift says nothing, from the nominal parameters.
 5. The best starts again from the nominal parameters and the size that fits these best, the runs
    taken in one by one, then from the best values of each of its unknowns by a loss that forgives,
    and from some way off, along the floor of its valley and out of it, as long as that leads down;
    at once where none closes much, and else where a second effect beside it leaves more than noise.
 6. The fit without effects starts again from the drift of the best joint fits: should it get as
    low, there was no effect, only a better valley. One that has come to such is followed down it.

Every step is a function of a model and plain data, so that steps run side by side on other
processes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.estimation.covariance import correlation_time, structure
from plant_emulator.estimation.least_squares import DIFFERENCE_NORM, estimate, linearise_at

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate, Unknown

# Relative fall of the cost that ends a fit here: a few hundredths in units of chi squared.
SETTLED = 1e-6
# The same of a fit whose slopes are not exact.
GLANCE_SETTLED = 1e-4
# Steps after which a fit shows whether it leads lower.
ADVANCED = 10
# A size is certain from so many of its standard errors on.
CERTAIN = 3.0
# Share of the largest size allowed from which on an effect does what it can for something else:
# what imitated another law of a first effect had come to 0.99 and more.
AT_BOUND = 0.95
# Mean square from which on a fit may lie in a wrong valley.
ASTRAY = 1.5
# What is known beforehand of a size that a prediction needs [plausible sizes].
SHY = 2.0
# A fit that is to be improved by starting again has to fall by more than this [chi squared].
WORTH = 1.0


def template(
    model: Model, effects: Sequence[str], runs: Sequence[int], *, shy: bool = False
) -> list[Unknown]:
    """All unknowns of a joint fit: drift, effects, states of every run (numbered from 0).

    shy : sizes are absent where these runs do not show them, not anywhere
    """
    own = [model.candidates[name] for name in effects]
    states = (*model.states, *(u for c in own for u in c.states))
    sizes = [_shy(u, c.neutral[u.name]) if shy else u for c in own for u in c.sizes]
    shared = (*model.parameters, *sizes, *(u for c in own for u in c.shapes))
    return [*shared, *(replace(u, run=k) for k in range(len(runs)) for u in states)]


def _shy(size: Unknown, neutral: float) -> Unknown:
    """A size near its neutral value beforehand, as far as it usually leaves it."""
    return replace(size, prior=neutral, std=SHY * abs(size.start - neutral))


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
    *,
    shy: bool = False,
    difference: float = DIFFERENCE_NORM,
) -> FitResult:
    """Joint fit of drift, states and these effects, from these values.

    near : see `estimate`'s `follow`; a first look only
    shy : see `template`
    difference : see `estimate`
    """
    unknowns = started(template(model, effects, runs, shy=shy), values, states)
    residuals = [model.residual(k, effects) for k in runs]
    settled = SETTLED if near is None else GLANCE_SETTLED
    found = estimate(
        unknowns,
        residuals,
        settled=settled,
        iterations=iterations,
        follow=near,
        difference=difference,
    )
    reached = point(effects, found, len(runs))
    sizes = {name: _largest(model.candidates[name], reached.values) for name in effects}
    unsure = tuple(name for name in effects if not _sure(model.candidates[name], reached))
    return replace(reached, sizes=sizes, unsure=unsure)


def _largest(candidate: Candidate, values: Mapping[str, float]) -> float:
    """The largest of an effect's sizes in plausible sizes; 0 of one that has none."""
    neutral = candidate.neutral
    sizes = (
        (values[u.name] - neutral[u.name]) / (u.start - neutral[u.name]) for u in candidate.sizes
    )
    return max(map(abs, sizes), default=0.0)


def _sure(candidate: Candidate, found: FitResult) -> bool:
    """Whether a size of an effect is not neutral by chance, and not as large as it may be; without
    values of each run none has to be told.
    """
    return not candidate.states or any(
        abs(size) > CERTAIN * found.errors[u.name]
        and abs(size) < AT_BOUND * abs((u.upper if size > 0.0 else u.lower) - neutral)
        for u in candidate.sizes
        for neutral in (candidate.neutral[u.name],)
        for size in (found.values[u.name] - neutral,)
    )


def again(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    start: FitResult,
    iterations: int | None = None,
) -> FitResult:
    """Joint fit with these effects from where another fit has come to."""
    return fit(model, effects, runs, start.values, start.states, iterations)


def linearised(model: Model, where: FitResult, runs: Sequence[int]) -> Estimate:
    """Residuals and Jacobians of a fit that has ended."""
    unknowns = started(template(model, where.effects, runs), where.values, where.states)
    return linearise_at(unknowns, [model.residual(k, where.effects) for k in runs])


def point(effects: Sequence[str], found: Estimate, runs: int) -> FitResult:
    """An estimate as plain data."""
    errors = zip(found.unknowns, found.z, found.standard_errors, strict=True)
    looks = sum(looks_of(found, k) for k in range(runs))
    return FitResult(
        effects=tuple(effects),
        values=found.parameters(),
        states=tuple(found.states(k) for k in range(runs)),
        cost=found.cost + found.penalty + looks,
        squares=found.cost,
        samples=found.samples,
        share=independent_share(found),
        errors={
            u.name: u.error(u.value(float(z)), float(e)) for u, z, e in errors if u.run is None
        },
        converged=found.converged,
        structure=sum(structure(channel) for run in found.residuals for channel in run),
        looks=looks,
    )


def looks_of(found: Estimate, run: int) -> float:
    """What the states of a run gain by being chosen among all that could be.

    - log det (P C), of those with a prior: P its precision, C the covariance after the fit, so that
    the cost falls as twice the logarithm of the probability with the states integrated out
    (Laplace's approximation: D. MacKay, Neural Computation 4 (1992) 415, his Occam factor). A phase
    and a frequency fit any noise a little; what they explain has to be more than that.
    """
    own = [j for j, u in enumerate(found.unknowns) if u.run == run and u.std is not None]
    if not own:
        return 0.0
    deviations = np.array([found.unknowns[j].scaled_std for j in own])
    narrowed = found.covariance[np.ix_(own, own)] / np.outer(deviations, deviations)
    return max(0.0, -float(np.linalg.slogdet(narrowed).logabsdet))


def independent_share(found: Estimate) -> float:
    """Share of the samples that are independent: the inverse of the mean autocorrelation time."""
    channels = [channel for residual in found.residuals for channel in residual]
    weight = np.array([np.count_nonzero(channel) for channel in channels], float)
    times = np.array([correlation_time(channel) for channel in channels])
    return float(weight.sum() / (weight * times).sum())


def null_fit(model: Model, runs: Sequence[int]) -> FitResult:
    """The fit without effects, from the model's own search; where that leaves much, from the
    nominal parameters as well.
    """
    found = fit(model, (), runs, *model.search(runs))
    if found.chi_squared <= ASTRAY:
        return found
    nominal = {u.name: u.prior for u in model.parameters}
    states = [model.start_states(k, (), nominal) for k in runs]
    other = fit(model, (), runs, nominal, states, ADVANCED)
    return found if found.cost <= other.cost else again(model, (), runs, other)
