"""Estimates a truck's road load, gear efficiency and load cell from its two road logs (pure).

`estimation.least_squares` minimises the whitened residual with the prior. It begins from several
starts and keeps the best optimum: a simulated truck that stops where the real truck crept on can
make a local minimum. A last fit uses the likeliest random walk of the noise (see
`random_walk_filter`). The load cell's noise makes the least walk, an uneven road makes more.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.estimation.least_squares import estimate
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.road_load.prior import (
    NAMES,
    Indices,
    Prior,
    parameters,
    prior_of,
    regression,
    starts,
    vector,
)
from plant_emulator.road_load.random_walk_filter import RandomWalkFilter, whitener

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.road_load.run import RoadRun
    from plant_emulator.road_load.signal import Mask
    from plant_emulator.road_load.truck_model import RoadParameters
    from plant_emulator.signals.log import Array

PARAMETER_SCALES = np.array([1e-5, 5e-5, 1e-3, 1e-3, 0.02, 1e-3, 2e-5, 1e-3])
"""Scale of each parameter in the search, in order of NAMES."""
LOWER = np.array([0.0, -0.01, 0.3, 0.5, -30.0, -20.0, -0.01, -10.0])
UPPER = np.array([0.2, 0.01, 1.0, 2.0, 30.0, 20.0, 0.01, 10.0])
WALKS = np.geomspace(1.0, 100.0, 13)
"""Candidates for the random walk, over the walk that the load cell's noise makes [1]."""


@dataclass(frozen=True, kw_only=True)
class RoadFit:
    """An optimum of the fit.

    free : indices of the fitted parameters
    residual : whitened residual, shape (samples,)
    jacobian : derivatives of the residual per unit of each parameter, shape (samples, free)
    cost : sum of squares of the residual and of the prior; settled : whether the solver converged
    walk : random walk of the noise, over the walk that the load cell's noise makes [1]
    reached : number of starts that reached this optimum, number of all starts
    """

    run: RoadRun
    values: RoadParameters
    free: Indices
    prior: Prior
    whitener: RandomWalkFilter
    residual: Array
    jacobian: Array
    cost: float
    settled: bool
    walk: float = 1.0
    reached: tuple[int, int] = (1, 1)


def fit(run: RoadRun, gain_deviation: float) -> RoadFit:
    """Fit the parameters from all starts and return the best optimum.

    gain_deviation : prior standard deviation of the load cell's gain from 1 [1]
    """
    prior = prior_of(run, gain_deviation)
    free = np.arange(len(NAMES) - (0 if run.moving_start else 1), dtype=np.int64)
    filters = filter_of(run, regression(run, prior), 1.0)
    found = [fit_from(run, start, free, prior, filters) for start in starts(run, prior)]
    best = min(found, key=lambda one: one.cost)
    reached = sum(one.cost < best.cost + 1.0 for one in found)
    walk = likeliest_walk(run, best.values)
    final = fit_from(run, best.values, free, prior, filter_of(run, best.values, walk))
    return replace(final, walk=walk, reached=(reached, len(found)))


def likeliest_walk(run: RoadRun, values: RoadParameters) -> float:
    """Likeliest random walk of the residual, over the walk that the load cell's noise makes [1].

    The likelihood uses means over 0.1 s, on which the low pass has no influence.
    """
    count = max(1, round(0.1 / run.spacing))

    def blocks(values: Array | Mask) -> Any:
        return values[: len(values) // count * count].reshape(-1, count)

    valid, rests, moves = (blocks(mask).all(axis=1) for mask in run.masks)
    mean = blocks(run.residual(values)).mean(axis=1)
    white, step = noises(run, values)
    scale = float(np.sqrt(count))

    def misfit(walk: float) -> float:
        return whitener(white / scale, walk * step * scale, valid, rests, moves).misfit(mean)

    return float(min(WALKS.tolist(), key=misfit))


def filter_of(run: RoadRun, values: RoadParameters, walk: float) -> RandomWalkFilter:
    """Whitener of this run.

    walk : step of the random walk, over the step that the load cell's noise makes [1]
    """
    white, step = noises(run, values)
    return whitener(white, walk * step, *run.masks)


def noises(run: RoadRun, values: RoadParameters) -> tuple[float, float]:
    """Standard deviations of a velocity sample, and of the walk's step per sample [m/s]."""
    truck = run.truck
    per_torque = truck.ratio * values.efficiency / (truck.wheel_radius * truck.mass)
    step = per_torque * run.torque_noise * float(np.sqrt(run.torque.period * run.spacing))
    return run.velocity_noise, step


def fit_from(
    run: RoadRun, start: RoadParameters, free: Indices, prior: Prior, filters: RandomWalkFilter
) -> RoadFit:
    """Fit the free parameters from one start."""
    base = vector(start)

    def values_of(found: Mapping[str, float]) -> RoadParameters:
        values = base.copy()
        values[free] = [found[NAMES[index]] for index in free]
        return parameters(values)

    def residual(found: Mapping[str, float]) -> Array:
        return filters.whiten(run.residual(values_of(found))[:, None]).T

    found = estimate(unknowns(base, free, prior), [residual])
    return RoadFit(
        run=run,
        values=values_of(found.parameters()),
        free=free,
        prior=prior,
        whitener=filters,
        residual=found.residuals[0][0],
        jacobian=found.jacobians[0][0] / PARAMETER_SCALES[free],
        cost=found.cost + found.penalty,
        settled=found.converged,
    )


def unknowns(start: Array, free: Indices, prior: Prior) -> list[Unknown]:
    """The free parameters with their starts, bounds and priors."""
    return [
        Unknown(
            name=NAMES[index],
            start=float(start[index]),
            lower=float(LOWER[index]),
            upper=float(UPPER[index]),
            logarithmic=False,
            scale=float(PARAMETER_SCALES[index]),
            prior=float(prior.mean[index]),
            std=float(deviation) if np.isfinite(deviation := prior.deviation[index]) else None,
        )
        for index in free
    ]
