"""Bounded nonlinear least squares on simulated channels, for any model that can be simulated.

What is asked of a model: for each run, a function from named values to the whitened residual
(measured minus simulated, over the noise), shape (channels, samples); 0 where a sample does not
count. The unknowns are parameters, shared by all runs, and states, each of one run only.

    minimise  sum r^2 + sum ((z - z_prior) / std)^2        z = log(value), or the value itself

by scipy's trust-region method. The Jacobian is made of forward differences so small that the
simulation keeps its sequence of steps; a state costs a simulation of its own run only.

Standard errors come from the residuals themselves, see `covariance`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.covariance import sandwich
from plant_emulator.estimation.unknowns import Estimate, Unknown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.signals.log import Array

# Forward differences: a change of the residual vector of this norm, within these steps of z. It is
# small against what the noise hides (1), far above the simulation's own jitter (1e-5), and wide
# enough to look over the kinks that contact and limits leave in the cost.
DIFFERENCE_NORM = 0.3
SMALLEST_DIFFERENCE, LARGEST_DIFFERENCE = 1e-6, 1e-3
# Largest step of the slopes that standard errors come from. Over a thousandth, the slope of a weak
# parameter was that of the one sample in which a contact fell: its standard error was wrong by
# four, and which sample that was, the last bits of the linear algebra decided.
WIDEST_DIFFERENCE = 1e-2
# Step of the first differences, before any slope is known.
FIRST_DIFFERENCE = 1e-5
MAX_ITERATIONS = 60
# Mean square above which a fit may lie in a local minimum, so that other starts are tried.
SUSPECT_MEAN_SQUARE = 1.5
# Relative fall of the cost that ends a fit: some 1e-6 in units of chi squared.
COST_SETTLED = 1e-10
Z_SETTLED = 1e-9


@dataclass
class _Problem:
    """Residuals and Jacobians of all runs at z, each simulated once."""

    unknowns: tuple[Unknown, ...]
    residuals: Sequence[Residual]
    progress: Callable[[float], None] | None
    follow: _Followed | None = None
    difference: float = DIFFERENCE_NORM
    simulations: int = 0
    known: tuple[bytes, list[Array]] = (b"", [])
    based: tuple[bytes, list[Array]] = (b"", [])
    slopes_known: tuple[bytes, list[Array]] = (b"", [])
    steps: Array = field(default_factory=lambda: np.zeros(0))

    def residual(self, z: Array) -> list[Array]:
        """Residual of every run at z, shape (channels, samples) each."""
        key = z.tobytes()
        if self.based[0] == key:  # the best point, to which the fit returns from a trial
            return self.based[1]
        if self.known[0] != key:
            self.known = key, [self._run(k, z) for k in range(len(self.residuals))]
            if self.progress is not None:
                self.progress(sum(float(np.sum(r**2)) for r in self.known[1]))
        return self.known[1]

    def _run(self, k: int, z: Array) -> Array:
        self.simulations += 1
        return self.residuals[k](_values(self.unknowns, z, k))

    def jacobian(self, z: Array) -> list[Array]:
        """Jacobian of every run at z, shape (channels, samples, unknowns) each.

        Differences are forward, at an upper bound backward.
        """
        key = z.tobytes()
        if self.slopes_known[0] != key:
            self.slopes_known = key, self._jacobian(z)
        return self.slopes_known[1]

    def _jacobian(self, z: Array) -> list[Array]:
        base = self.residual(z)
        self.based = z.tobytes(), base
        jacobians = [np.zeros((*r.shape, len(z))) for r in base]
        for j in range(len(z)):
            if self.follow is None or not self.follow.has[j]:
                self._difference(z, j, jacobians)
        if self.follow is not None:
            self.follow.fill(z, base, jacobians)
        self.steps = _steps(jacobians, self.difference)
        return jacobians

    def _difference(self, z: Array, j: int, jacobians: Sequence[Array]) -> None:
        """Fill in the column of one unknown."""
        unknown, base, step = self.unknowns[j], self.residual(z), self.steps[j]
        if z[j] + step > unknown.scaled(unknown.upper):
            step = -step
        changed = z.copy()
        changed[j] += step
        for k in range(len(base)) if unknown.run is None else (unknown.run,):
            jacobians[k][..., j] = (self._run(k, changed) - base[k]) / (changed[j] - z[j])

    def wide_jacobian(self, z: Array) -> list[Array]:
        """Jacobian of every run at z, with the columns of weak unknowns over wider differences."""
        jacobians = [j.copy() for j in self.jacobian(z)]
        if self.follow is not None:
            return jacobians
        narrow, self.steps = self.steps, _steps(jacobians, self.difference, WIDEST_DIFFERENCE)
        for j in np.flatnonzero(self.steps > narrow):
            self._difference(z, int(j), jacobians)
        return jacobians

    def rows(self, z: Array) -> Array:
        """All residuals and the priors as one vector."""
        return np.concatenate([*(r.ravel() for r in self.residual(z)), self._prior(z)])

    def slopes(self, z: Array) -> Array:
        """Jacobian of `rows`, shape (rows, unknowns)."""
        p = len(z)
        weight = np.diag([1.0 / u.scaled_std for u in self.unknowns])
        return np.concatenate([*(j.reshape(-1, p) for j in self.jacobian(z)), weight])

    def _prior(self, z: Array) -> Array:
        return np.array(
            [
                (z[j] - u.scaled(u.prior)) / u.scaled_std if u.std is not None else 0.0
                for j, u in enumerate(self.unknowns)
            ]
        )


class _Followed:
    """Columns of the Jacobian that are not differenced: they begin as those of another estimate and
    follow the residual by secants (Broyden, Math. Comp. 19 (1965) 577).
    """

    def __init__(self, unknowns: Sequence[Unknown], other: Estimate) -> None:
        column = {(u.name, u.run): j for j, u in enumerate(other.unknowns)}
        self.has = np.array([(u.name, u.run) in column for u in unknowns])
        wanted = [column[u.name, u.run] for u in unknowns if (u.name, u.run) in column]
        self._slopes = [j[..., wanted] for j in other.jacobians]
        self._last: tuple[Array, Sequence[Array], Sequence[Array]] | None = None

    def fill(self, z: Array, residuals: Sequence[Array], jacobians: Sequence[Array]) -> None:
        """Put the columns into Jacobians at z that have all others."""
        if self._last is not None:
            before, old, others = self._last
            step = z - before
            weight = sum(np.einsum("cnj,cnj->j", j, j) for j in self._slopes) * step[self.has]
            length = float(weight @ step[self.has])
            if length > 0.0:
                for k, jacobian in enumerate(jacobians):
                    between = 0.5 * (others[k] + jacobian)[..., ~self.has]
                    missed = residuals[k] - old[k] - between @ step[~self.has]
                    missed -= self._slopes[k] @ step[self.has]
                    self._slopes[k] += missed[..., None] * (weight / length)
        for slopes, jacobian in zip(self._slopes, jacobians, strict=True):
            jacobian[..., self.has] = slopes
        self._last = z.copy(), list(residuals), list(jacobians)


def _values(unknowns: Sequence[Unknown], z: Array, run: int) -> dict[str, float]:
    return {u.name: u.value(float(z[j])) for j, u in enumerate(unknowns) if u.run in {None, run}}


def _steps(
    jacobians: Sequence[Array], difference: float, most: float = LARGEST_DIFFERENCE
) -> Array:
    """Steps of z that change the residual vector by a norm, within their bounds."""
    squares = np.sum([np.einsum("cnj,cnj->j", j, j) for j in jacobians], axis=0)
    wanted = difference / np.sqrt(np.maximum(squares, 1e-300))
    largest = most * max(1.0, difference)
    return np.asarray(np.clip(wanted, SMALLEST_DIFFERENCE, largest))


def estimate(
    unknowns: Sequence[Unknown],
    residuals: Sequence[Residual],
    *,
    settled: float = COST_SETTLED,
    iterations: int | None = None,
    progress: Callable[[float], None] | None = None,
    follow: Estimate | None = None,
    difference: float = DIFFERENCE_NORM,
) -> Estimate:
    """Fit the unknowns from their starts.

    A fit does not begin where no unknown changes the residual, as where nothing can be simulated.

    residuals : one function a run, from the values by name to the whitened residual
    settled : relative fall of the cost that ends the fit
    iterations : at most so many; None: MAX_ITERATIONS
    progress : called with the sum of squares after every simulation of all runs
    follow : an estimate nearby, of the same runs; the columns of its unknowns are then not
        simulated but follow by secants: far cheaper, and good for a first look only
    difference : norm of the change of the residual vector that slopes are taken over; a wide one
        passes over local minima of a rough cost, and serves a search only
    """
    from scipy.optimize import least_squares
    from threadpoolctl import threadpool_limits

    unknowns = tuple(unknowns)
    lower = np.array([u.scaled(u.lower) for u in unknowns])
    upper = np.array([u.scaled(u.upper) for u in unknowns])
    margin = 1e-6 * (upper - lower)
    start = np.array([u.scaled(u.start) for u in unknowns])
    followed = None if follow is None else _Followed(unknowns, follow)
    problem = _Problem(unknowns, residuals, progress, followed, difference)
    problem.steps = np.full(len(unknowns), FIRST_DIFFERENCE)
    start = np.clip(start, lower + margin, upper - margin)
    free = any(u.std is None for u in unknowns)
    if free and not any(slopes.any() for slopes in problem.jacobian(start)):
        return _estimate(problem, start, False, "no unknown changes the residual")
    # Threads that wait for each other in a decomposition of ten columns take most of the time.
    with threadpool_limits(1):
        found = least_squares(
            problem.rows,
            start,
            problem.slopes,
            bounds=(lower, upper),
            x_scale="jac",
            ftol=settled,
            xtol=Z_SETTLED,
            gtol=None,
            max_nfev=iterations or MAX_ITERATIONS,
        )
    return _estimate(problem, found.x, bool(found.status > 0), str(found.message))


def linearise_at(
    unknowns: Sequence[Unknown],
    residuals: Sequence[Residual],
    *,
    near: Estimate | None = None,
) -> Estimate:
    """Linearise the residuals at the starts of the unknowns, and return it as an estimate there.

    near : a linearisation nearby, whose slopes set the steps of the differences. Without it every
        step is FIRST_DIFFERENCE: a residual that hardly changes over it, such as that of a weak
        parameter, is then lost in the jitter of the simulation
    """
    problem = _Problem(tuple(unknowns), residuals, None)
    if near is None:
        problem.steps = np.full(len(unknowns), FIRST_DIFFERENCE)
    else:
        problem.steps = _steps(near.jacobians, DIFFERENCE_NORM)
    z = np.array([u.scaled(u.start) for u in unknowns])
    return _estimate(problem, z, True, "not fitted")


def _estimate(problem: _Problem, z: Array, converged: bool, message: str) -> Estimate:
    residuals, jacobians = problem.residual(z), problem.wide_jacobian(z)
    information = sum(np.einsum("cni,cnj->ij", j, j) for j in jacobians)
    precision = np.diag([u.scaled_std**-2.0 for u in problem.unknowns])
    return Estimate(
        unknowns=problem.unknowns,
        z=z,
        residuals=tuple(residuals),
        jacobians=tuple(jacobians),
        covariance=sandwich(residuals, jacobians, information, precision),
        information=information,
        cost=sum(float(np.sum(r**2)) for r in residuals),
        penalty=float(np.sum(problem.rows(z)[-len(z) :] ** 2)),
        samples=sum(int(np.count_nonzero(r)) for r in residuals),
        simulations=problem.simulations,
        converged=converged,
        message=message,
    )
