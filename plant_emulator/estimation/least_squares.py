"""Bounded nonlinear least squares on simulated channels, for any model that can be simulated.

What is asked of a model: for each run, a function from named values to the whitened residual
(measured minus simulated, over the noise), shape (channels, samples); 0 where a sample does not
count. The unknowns are parameters, shared by all runs, and states, each of one run only.

    minimise  sum r^2 + sum ((z - z_prior) / std)^2        z = log(value), or the value itself

by scipy's trust-region method; slopes: see `simulated_problem`. Where it stands still, steps go on
that bound the leverage of a sample; the last ones do not, so that the optimum is that of least
squares.

Standard errors come from the residuals themselves, with bounded leverage, see `covariance`; not
those of a rough fit.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.covariance import sandwich, white_covariance
from plant_emulator.estimation.leverage import bounding_weights
from plant_emulator.estimation.secant_slopes import SecantSlopes
from plant_emulator.estimation.simulated_problem import DIFFERENCE_NORM, SimulatedProblem
from plant_emulator.estimation.unknowns import Estimate, Unknown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scipy.optimize import OptimizeResult

    from plant_emulator.estimation.unknowns import Lengths, Residual
    from plant_emulator.signals.log import Array

MAX_ITERATIONS = 60
# Mean square above which a fit may lie in a local minimum, so that other starts are tried, and
# slopes around it mislead. What is left then is correlated.
SUSPECT_MEAN_SQUARE = 1.5
# Fall of the cost that steps with bounded leverage must promise, and keep, to be taken: a tenth of
# the gain that an effect needs [chi squared].
PROMISING_FALL = 3.0
# Relative fall of the cost that ends a fit: some 1e-6 in units of chi squared.
COST_SETTLED = 1e-10
Z_SETTLED = 1e-9


def estimate(
    unknowns: Sequence[Unknown],
    residuals: Sequence[Residual],
    *,
    settled: float = COST_SETTLED,
    settled_far: float = 0.0,
    iterations: int | None = None,
    progress: Callable[[float], None] | None = None,
    follow: Estimate | None = None,
    lengths: Lengths = MappingProxyType({}),
    difference: float = DIFFERENCE_NORM,
    rough: bool = False,
    symmetric: bool = False,
) -> Estimate:
    """Fit the unknowns from their starts.

    A fit does not begin where no unknown changes the residual, as where nothing can be simulated.

    residuals : one function a run, from the values by name to the whitened residual
    settled : relative fall of the cost that ends the fit
    settled_far : the same, if it is more, where the mean square is above SUSPECT_MEAN_SQUARE
    iterations : at most so many; None: MAX_ITERATIONS
    progress : called with the sum of squares after every simulation of all runs
    follow : an estimate nearby, of the same runs; the columns of its unknowns are then not
        simulated but follow by secants: far cheaper, and good for a first look only
    lengths : of slopes nearby, see `Estimate.lengths`, where they are known
    difference : norm of the change of the residual vector that slopes are taken over; a wide one
        passes over local minima of a rough cost, and serves a search only
    rough : whether the values are a start only, as with `follow` in any case: all slopes follow
        steps that they predicted well, and the covariance is that of white residuals
    symmetric : whether the slopes that it tells are taken over a standard deviation around the
        optimum: standard errors then hold where contact comes and goes, in three times the time
    """
    unknowns = tuple(unknowns)
    rough = rough or follow is not None
    secants = SecantSlopes(unknowns, follow, rough=rough)
    problem = SimulatedProblem(
        unknowns, residuals, progress, secants, _lengths_of(unknowns, lengths), difference
    )
    start, lower, upper = _start(unknowns)
    known = np.isfinite(problem.lengths)
    if known.any() and not known.all():  # what follows secants must not begin in last digits
        problem.learn_steps(start)
    free = any(u.std is None for u in unknowns)
    if free and not any(slopes.any() for slopes in problem.jacobian(start)):
        slopes = _slopes(problem, rough=rough, symmetric=symmetric)
        return _estimate(problem, start, slopes, False, "no unknown changes the residual", rough)
    most, bounds = iterations or MAX_ITERATIONS, (lower, upper)
    found, left = _descend(problem, start, bounds, max(settled, settled_far), most)
    rows = problem.residual(found.x)
    samples = sum(np.count_nonzero(r) for r in rows)
    near = sum(float(np.sum(r**2)) for r in rows) <= SUSPECT_MEAN_SQUARE * samples
    if near and settled < settled_far and left > 0:
        found = _minimise(problem, found.x, bounds, settled, left)
    slopes = _slopes(problem, rough=rough, symmetric=symmetric)
    return _estimate(problem, found.x, slopes, bool(found.status > 0), str(found.message), rough)


def _lengths_of(unknowns: Sequence[Unknown], known: Lengths) -> Array:
    """Lengths of the slopes of these unknowns; NaN where they are not known."""
    return np.array([known.get((u.name, u.run), np.nan) for u in unknowns])


def _start(unknowns: Sequence[Unknown]) -> tuple[Array, Array, Array]:
    """Start of z within its bounds, the lower and the upper bounds."""
    lower = np.array([u.scaled(u.lower) for u in unknowns])
    upper = np.array([u.scaled(u.upper) for u in unknowns])
    margin = 1e-6 * (upper - lower)
    start = np.array([u.scaled(u.start) for u in unknowns])
    return np.clip(start, lower + margin, upper - margin), lower, upper


def _descend(
    problem: SimulatedProblem,
    start: Array,
    bounds: tuple[Array, Array],
    settled: float,
    iterations: int,
) -> tuple[OptimizeResult, int]:
    """Minimise, in turn with steps that bound the leverage of samples where the others stand still.

    Plain steps end at the optimum, bounded ones only near it.

    returns the result, and how many iterations are left
    """
    found = _minimise(problem, start, bounds, settled, iterations)
    left = iterations - found.nfev
    while left > 0 and problem.promise(found.x) > PROMISING_FALL:
        problem.bounding = True
        moved = _minimise(problem, found.x, bounds, settled, left)
        problem.bounding = False
        left -= moved.nfev
        stands = 2.0 * (found.cost - moved.cost) < PROMISING_FALL
        if not stands and left > 0:
            moved = _minimise(problem, moved.x, bounds, settled, left)
            left -= moved.nfev
        found = min(found, moved, key=lambda one: one.cost)
        if stands:
            break
    return found, left


def _minimise(
    problem: SimulatedProblem,
    start: Array,
    bounds: tuple[Array, Array],
    settled: float,
    iterations: int,
) -> OptimizeResult:
    from scipy.optimize import least_squares
    from threadpoolctl import threadpool_limits

    # Threads that wait for each other in a decomposition of ten columns take most of the time.
    with threadpool_limits(1):
        return least_squares(
            problem.turned_rows,
            start,
            problem.turned_slopes,
            bounds=bounds,
            x_scale="jac",
            ftol=settled,
            xtol=Z_SETTLED,
            gtol=None,
            max_nfev=iterations,
        )


def linearise_at(
    unknowns: Sequence[Unknown],
    residuals: Sequence[Residual],
    *,
    lengths: Lengths = MappingProxyType({}),
    symmetric: bool = False,
) -> Estimate:
    """Linearise the residuals at the starts of the unknowns, and return it as an estimate there.

    lengths : of slopes nearby, which tell the steps of the differences. Where they are not known,
        the steps follow from a first differencing
    symmetric : see `estimate`
    """
    unknowns = tuple(unknowns)
    problem = SimulatedProblem(
        unknowns,
        residuals,
        None,
        SecantSlopes(unknowns),
        _lengths_of(unknowns, lengths),
    )
    z = np.array([u.scaled(u.start) for u in unknowns])
    problem.learn_steps(z)
    return _estimate(problem, z, _slopes(problem, symmetric=symmetric), True, "not fitted")


def _slopes(
    problem: SimulatedProblem, *, rough: bool = False, symmetric: bool = False
) -> Callable[[Array], list[Array]]:
    """The Jacobian that an estimate tells."""
    if rough:
        return problem.jacobian
    return problem.symmetric_jacobian if symmetric else problem.wide_jacobian


def _estimate(
    problem: SimulatedProblem,
    z: Array,
    slopes: Callable[[Array], list[Array]],
    converged: bool,
    message: str,
    rough: bool = False,
) -> Estimate:
    residuals, jacobians = problem.residual(z), slopes(z)
    information = sum(np.einsum("cni,cnj->ij", j, j) for j in jacobians)
    precision = np.diag([u.scaled_std**-2.0 for u in problem.unknowns])
    if rough:
        covariance = white_covariance(information, precision)
    else:
        covariance = _bounded_sandwich(residuals, jacobians, precision)
    return Estimate(
        unknowns=problem.unknowns,
        z=z,
        residuals=tuple(residuals),
        jacobians=tuple(jacobians),
        covariance=covariance,
        information=information,
        cost=sum(float(np.sum(r**2)) for r in residuals),
        penalty=float(np.sum(problem.rows(z)[-len(z) :] ** 2)),
        samples=sum(int(np.count_nonzero(r)) for r in residuals),
        simulations=problem.simulations,
        converged=converged,
        message=message,
    )


def _bounded_sandwich(
    residuals: Sequence[Array], jacobians: Sequence[Array], precision: Array
) -> Array:
    """The covariance with samples of bounded leverage.

    The slope of a sample that a contact falls on tells the time of the contact to a microsecond. No
    solver and no row of a log is that exact.
    """
    flat = [j.reshape(-1, len(precision)) for j in jacobians]
    weights = [
        w.reshape(r.shape)
        for w, r in zip(bounding_weights(flat, np.sqrt(precision)), residuals, strict=True)
    ]
    slopes = [w[..., None] * j for w, j in zip(weights, jacobians, strict=True)]
    return sandwich(
        [w * r for w, r in zip(weights, residuals, strict=True)],
        slopes,
        sum(np.einsum("cni,cnj->ij", j, j) for j in slopes),
        precision,
    )
