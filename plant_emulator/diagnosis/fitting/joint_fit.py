"""The joint fit of one hypothesis: nuisance parameters, effects and initial states together.

The fit minimises the penalised sum of squares of the whitened residuals r of all runs,

    cost = sum r^2 + sum ((z - z_prior) / std)^2 + Occam penalty

z are the unknowns on the scale of the estimation. The nuisance parameters are the parameters of
the machine that may differ from their nominal values. Every effect adds its sizes and its shapes;
every run adds its initial states. The Occam penalty charges the choice of sizes, shapes and states
(D. MacKay, Neural Computation 4 (1992) 415); see `Estimate.occam_penalty`.

The functions take a model and plain data, so that other processes can run them.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitResult, FitValues
from plant_emulator.estimation.covariance import correlation_time, structure
from plant_emulator.estimation.least_squares import estimate, linearise_at

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate, Lengths, Unknown

# Relative fall of the cost that ends a fit near the noise: some tenths in units of chi squared.
COST_TOLERANCE = 1e-5
# Relative fall of the cost that ends a fit far from the noise, where it lacks a cause in any case,
# or a fit whose slopes follow by secants.
COARSE_COST_TOLERANCE = 1e-4
# A size differs from neutral for certain from so many of its standard errors on.
SIGNIFICANT_ERRORS = 3.0
# Share of the largest size or change allowed from which on an effect or a parameter stands for
# something else. An effect that stood for another law of a first effect came to 0.99 and more, and
# so did a flux constant beside an effect that stood for a reaction of the armature.
AT_BOUND = 0.95
# Standard deviation of the shrinkage prior of a size [plausible sizes].
SHRINKAGE = 2.0


def joint_unknowns(
    model: Model, effects: Sequence[str], runs: Sequence[int], *, shrinkage: bool = False
) -> list[Unknown]:
    """List all unknowns of a joint fit: parameters, sizes, shapes, and the states of every run.

    runs : of the model; their states are numbered from 0
    shrinkage : whether the sizes have a prior at neutral, so that a size that these runs do not
        show stays near neutral
    """
    own = [model.candidates[name] for name in effects]
    states = (*model.states, *(u for c in own for u in c.states))
    sizes = [_shrunk(u, c.neutral[u.name]) if shrinkage else u for c in own for u in c.sizes]
    shared = (*model.parameters, *sizes, *(u for c in own for u in c.shapes))
    return [*shared, *(replace(u, run=k) for k in range(len(runs)) for u in states)]


def _shrunk(size: Unknown, neutral: float) -> Unknown:
    """A size with a shrinkage prior around its neutral value."""
    return replace(size, prior=neutral, std=SHRINKAGE * abs(size.start - neutral))


def charged(model: Model, effects: Sequence[str]) -> list[Unknown]:
    """Sizes and shapes of effects, with the priors that the Occam penalty charges."""
    own = [model.candidates[name] for name in effects]
    return [u for c in own for u in (*(_shrunk(u, c.neutral[u.name]) for u in c.sizes), *c.shapes)]


def with_starts(
    unknowns: Sequence[Unknown], values: Mapping[str, float], states: Sequence[Mapping[str, float]]
) -> list[Unknown]:
    """The unknowns, each starting at its value among these, within its bounds."""
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
    shrinkage: bool = False,
    lengths: Lengths = MappingProxyType({}),
) -> FitResult:
    """Fit parameters, states and these effects to these runs, from these start values.

    iterations : at most so many; None: as many as `estimate` allows
    near : an estimate of the same runs; slopes of its unknowns follow by secants, see `estimate`.
        The standard errors are then those of white residuals of variance 1
    shrinkage : see `joint_unknowns`
    lengths : of the slopes, see `estimate`
    """
    unknowns = with_starts(
        joint_unknowns(model, effects, runs, shrinkage=shrinkage), values, states
    )
    residuals = [model.residual(k, effects) for k in runs]
    found = estimate(
        unknowns,
        residuals,
        settled=COST_TOLERANCE if near is None else COARSE_COST_TOLERANCE,
        settled_far=COARSE_COST_TOLERANCE,
        iterations=iterations,
        follow=near,
        lengths=lengths,
    )
    candidates = {name: model.candidates[name] for name in effects}
    reached = to_result(effects, found, len(runs), charged(model, effects))
    return replace(
        reached,
        insignificant=tuple(n for n, c in candidates.items() if not _significant(c, reached)),
    )


def _significant(candidate: Candidate, found: FitResult) -> bool:
    """Whether a size of an effect differs from neutral for certain, and is not at its bound.

    An effect without states of its own needs no certain size.
    """
    return not candidate.states or any(
        abs(size) > SIGNIFICANT_ERRORS * found.standard_errors[u.name]
        and abs(size) < AT_BOUND * abs((u.upper if size > 0.0 else u.lower) - neutral)
        for u in candidate.sizes
        for neutral in (candidate.neutral[u.name],)
        for size in (found.values[u.name] - neutral,)
    )


def fit_from(
    model: Model, effects: Sequence[str], runs: Sequence[int], start: FitResult
) -> FitResult:
    """Fit these effects from the values and states of another fit."""
    return fit(model, effects, runs, start.values, start.states, lengths=start.lengths)


def linearise(
    model: Model, found: FitValues, runs: Sequence[int], further: Sequence[Unknown] = ()
) -> Estimate:
    """Compute residuals, Jacobians and covariance at the values of a fit, without fitting.

    further : unknowns behind those of the fit
    """
    own = with_starts(joint_unknowns(model, found.effects, runs), found.values, found.states)
    unknowns = (*own, *further)
    residuals = [model.residual(k, found.effects) for k in runs]
    return linearise_at(unknowns, residuals, lengths=found.lengths)


def to_result(
    effects: Sequence[str], found: Estimate, runs: int, chosen: Sequence[Unknown] = ()
) -> FitResult:
    """Turn an estimate with these effects into plain data.

    runs : number of fitted runs
    chosen : sizes and shapes of the effects, with the priors that the Occam penalty charges
    """
    errors = zip(found.unknowns, found.z, found.standard_errors, strict=True)
    priors = {u.name: u for u in chosen}
    groups = [[priors.get(u.name) if u.run is None else None for u in found.unknowns]]
    groups += [[u if u.run == k else None for u in found.unknowns] for k in range(runs)]
    penalty = sum(found.occam_penalty(group) for group in groups)
    return FitResult(
        effects=tuple(effects),
        values=found.parameters(),
        states=tuple(found.states(k) for k in range(runs)),
        lengths=found.lengths,
        cost=found.cost + found.penalty + penalty,
        sum_of_squares=found.cost,
        samples=found.samples,
        effective_fraction=effective_fraction(found),
        standard_errors={
            u.name: u.error(u.value(float(z)), float(e)) for u, z, e in errors if u.run is None
        },
        converged=found.converged,
        ljung_box_excess=sum(structure(channel) for run in found.residuals for channel in run),
        occam_penalty=penalty,
    )


def effective_fraction(found: Estimate) -> float:
    """Share of the samples that are independent [1]: one over the mean autocorrelation time."""
    channels = [channel for residual in found.residuals for channel in residual]
    weight = np.array([np.count_nonzero(channel) for channel in channels], float)
    times = np.array([correlation_time(channel) for channel in channels])
    return float(weight.sum() / (weight * times).sum())
