"""Estimates a truck's road load, gear and load cell from its two road logs (pure).

Several starts, because a simulated truck that stops where the real one crept on (or the other way
round) can make valleys of its own. From each a bounded nonlinear least-squares fit of the whitened
residual, beside which what is known beforehand stands as residuals of its own; the best is kept.
The share of the random walk in the noise (see `road_whiten`) is at least what the load cell's own
noise makes, and as much as the residual asks for: roads are not even.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

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
from plant_emulator.road_load.random_walk_filter import Whitener, whitener

if TYPE_CHECKING:
    from plant_emulator.road_load.run import RoadRun
    from plant_emulator.road_load.signal import Mask
    from plant_emulator.road_load.truck_model import RoadParameters
    from plant_emulator.signals.log import Array

STEPS = np.array([1e-5, 5e-5, 1e-3, 1e-3, 0.02, 1e-3, 2e-5, 1e-3])
"""A small change of each parameter: scale of the search, and step of the differences."""
LOWER = np.array([0.0, -0.01, 0.3, 0.5, -30.0, -20.0, -0.01, -10.0])
UPPER = np.array([0.2, 0.01, 1.0, 2.0, 30.0, 20.0, 0.01, 10.0])
EVALUATIONS = 60
WALKS = np.geomspace(1.0, 100.0, 13)


@dataclass(frozen=True, kw_only=True)
class RoadFit:
    """An optimum: values, whitened residual and its derivatives, of data and of the prior.

    free : indices of the fitted parameters; cost : sum of squares; settled : the solver's word
    jacobian, shape (rows, free), per unit of each parameter; reached : starts that came here
    """

    run: RoadRun
    values: RoadParameters
    free: Indices
    prior: Prior
    whitener: Whitener
    residual: Array
    jacobian: Array
    cost: float
    settled: bool
    walk: float = 1.0
    reached: tuple[int, int] = (1, 1)


def fit(run: RoadRun, gain_deviation: float) -> RoadFit:
    """The best fit of all starts. gain_deviation : of the load cell's gain beforehand [1]"""
    prior = prior_of(run, gain_deviation)
    free = np.arange(len(NAMES) - (0 if run.moving_start else 1), dtype=np.int64)
    filters = filter_of(run, regression(run, prior), 1.0)
    found = [descended(run, start, free, prior, filters) for start in starts(run, prior)]
    best = min(found, key=lambda one: one.cost)
    reached = sum(one.cost < best.cost + 1.0 for one in found)
    walk = likeliest_walk(run, best.values)
    final = descended(run, best.values, free, prior, filter_of(run, best.values, walk))
    return replace(final, walk=walk, reached=(reached, len(found)))


def likeliest_walk(run: RoadRun, values: RoadParameters) -> float:
    """How many times the load cell's noise the random walk of this residual needs; at least 1.

    Judged by means over 0.1 s, in which the low pass leaves no trace.
    """
    count = max(1, round(0.1 / run.spacing))

    def blocks(values: Array | Mask) -> Any:
        return values[: len(values) // count * count].reshape(-1, count)

    known, rests, moves = (blocks(mask).all(axis=1) for mask in run.masks)
    mean = blocks(run.residual(values)).mean(axis=1)
    white, step = noises(run, values)
    scale = float(np.sqrt(count))

    def misfit(walk: float) -> float:
        return whitener(white / scale, walk * step * scale, known, rests, moves).misfit(mean)

    return float(min(WALKS.tolist(), key=misfit))


def filter_of(run: RoadRun, values: RoadParameters, walk: float) -> Whitener:
    """Whitener of this run; walk : of the steps, in those that the load cell's noise makes."""
    white, step = noises(run, values)
    return whitener(white, walk * step, *run.masks)


def noises(run: RoadRun, values: RoadParameters) -> tuple[float, float]:
    """Standard deviations of the compared velocity and of the walk's step between two [m/s]."""
    truck = run.truck
    per_torque = truck.ratio * values.efficiency / (truck.wheel_radius * truck.mass)
    step = per_torque * run.torque_noise * float(np.sqrt(run.torque.period * run.spacing))
    return run.velocity_noise, step


def descended(
    run: RoadRun, start: RoadParameters, free: Indices, prior: Prior, filters: Whitener
) -> RoadFit:
    """The optimum that bounded least squares finds from there."""
    from scipy.optimize import least_squares
    from threadpoolctl import threadpool_limits

    base, scale = vector(start), STEPS[free]

    def values_at(x: Array) -> Array:
        values = base.copy()
        values[free] = x * scale
        return values

    def rows(x: Array) -> Array:
        values = values_at(x)
        data = filters.whitened(run.residual(parameters(values))[:, None])[:, 0]
        return np.concatenate([data, prior.residual(values)])

    def slopes(x: Array) -> Array:
        data = filters.whitened(differences(run, values_at(x), free)) * scale
        known = np.zeros((len(prior.rows), len(free)))
        for row, index in enumerate(prior.rows):
            known[row] = np.where(free == index, -scale / prior.deviation[index], 0.0)
        return np.concatenate([data, known])

    bounds = (LOWER[free] / scale, UPPER[free] / scale)
    x0 = np.clip(base[free] / scale, bounds[0], bounds[1])
    # Decompositions of eight columns gain nothing from a second thread and spend twice the time.
    with threadpool_limits(1):
        found = least_squares(
            rows, x0, slopes, bounds, xtol=1e-7, ftol=1e-7, gtol=1e-7, max_nfev=EVALUATIONS
        )
    return RoadFit(
        run=run,
        values=parameters(values_at(found.x)),
        free=free,
        prior=prior,
        whitener=filters,
        residual=found.fun,
        jacobian=np.asarray(found.jac, dtype=np.float64) / scale,
        cost=float(2.0 * found.cost),
        settled=bool(found.status > 0),
    )


def differences(run: RoadRun, values: Array, free: Indices) -> Array:
    """Derivatives of the residual by central differences, shape (m, free), per unit."""

    def moved(index: int, by: float) -> Array:
        changed = values.copy()
        changed[index] += by
        return run.residual(parameters(changed))

    def slope(index: int) -> Array:
        step = STEPS[index]
        return np.asarray((moved(index, step) - moved(index, -step)) / (2.0 * step))

    return np.stack([slope(int(index)) for index in free], axis=1)
