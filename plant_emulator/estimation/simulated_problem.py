"""Residuals of simulated runs and their slopes, as functions of the unknowns of a fit (pure).

The Jacobian is made of forward differences so small that the simulation keeps its sequence of
steps; a state costs a simulation of its own run only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from plant_emulator.estimation.unknowns import Estimate, Residual, Unknown
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


@dataclass
class SimulatedProblem:
    """Residuals and Jacobians of all runs at z, each simulated once.

    follow : columns that are not differenced; None: every column is
    difference : norm of the change of the residual vector that slopes are taken over
    """

    unknowns: tuple[Unknown, ...]
    residuals: Sequence[Residual]
    progress: Callable[[float], None] | None
    follow: FollowedColumns | None = None
    difference: float = DIFFERENCE_NORM
    simulations: int = 0
    known: tuple[bytes, list[Array]] = (b"", [])
    based: tuple[bytes, list[Array]] = (b"", [])
    slopes_known: tuple[bytes, list[Array]] = (b"", [])
    lengths: Array | None = None

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

    def learn_steps(self, z: Array) -> None:
        """Take the steps of the differences at z from first slopes.

        Over FIRST_DIFFERENCE the slope of a weak parameter is lost in the jitter of the simulation.
        """
        self._jacobian(z)

    def _jacobian(self, z: Array) -> list[Array]:
        base = self.residual(z)
        self.based = z.tobytes(), base
        jacobians = [np.zeros((*r.shape, len(z))) for r in base]
        steps = self._steps()
        for j in range(len(z)):
            if self.follow is None or not self.follow.has[j]:
                self._difference(z, j, steps[j], jacobians)
        if self.follow is not None:
            self.follow.fill(z, base, jacobians)
        self.lengths = column_lengths(jacobians)
        return jacobians

    def _steps(self, most: float = LARGEST_DIFFERENCE) -> Array:
        """Steps of z that change the residual vector by a norm, within their bounds."""
        if self.lengths is None:
            return np.full(len(self.unknowns), FIRST_DIFFERENCE)
        steps = np.clip(
            self.difference / self.lengths, SMALLEST_DIFFERENCE, most * max(1.0, self.difference)
        )
        return np.asarray(steps)

    def _difference(self, z: Array, j: int, step: float, jacobians: Sequence[Array]) -> None:
        """Fill in the column of one unknown."""
        unknown, base = self.unknowns[j], self.residual(z)
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
        narrow, wide = self._steps(), self._steps(WIDEST_DIFFERENCE)
        for j in np.flatnonzero(wide > narrow):
            self._difference(z, int(j), wide[j], jacobians)
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


class FollowedColumns:
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


def column_lengths(jacobians: Sequence[Array]) -> Array:
    """Norm of the column of each unknown, shape (unknowns,)."""
    squares = np.sum([np.einsum("cnj,cnj->j", j, j) for j in jacobians], axis=0)
    return np.asarray(np.sqrt(np.maximum(squares, 1e-300)))
