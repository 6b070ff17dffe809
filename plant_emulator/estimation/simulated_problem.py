"""Residuals of simulated runs and their slopes, as functions of the unknowns of a fit (pure).

The Jacobian is made of forward differences, whose simulations follow the steps of the one at the
point; a state costs a simulation of its own run only. In a rough fit nothing is differenced after a
step that the slopes predicted well: they follow the step by secants.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.leverage import beside_residual, bounding_weights
from plant_emulator.estimation.nearby import near
from plant_emulator.estimation.secant_slopes import HIDDEN_NORM, SecantSlopes
from plant_emulator.estimation.unknowns import column_lengths

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.signals.log import Array

# Forward differences: a change of the residual vector of this norm, within these steps of z. It is
# small against what the noise hides (1), so that slopes are those of the point itself, and far
# above the last digits of a simulation, which are a norm of 1e-9.
DIFFERENCE_NORM = 0.03
# Largest such norm at which simulations follow the steps of the point: nothing watches their error.
FOLLOWED_NORM = 1.0
# Norm of a slope that is made of last digits: its standard error would be a thousand on the scale
# of the estimation. It counts as none.
ROUNDING_SLOPE = 1e-3
SMALLEST_DIFFERENCE, LARGEST_DIFFERENCE = 1e-8, 1e-3
# Largest step of the slopes that standard errors come from. Over a thousandth, the slope of a weak
# parameter was that of the one sample in which a contact fell: its standard error was wrong by
# four, and which sample that was, the last bits of the linear algebra decided.
WIDEST_DIFFERENCE = 1e-2
# Change of the residual vector over which symmetric slopes are taken to each side [norm]: over one
# standard deviation in all, because over less a slope may be that of a single contact.
HALF_DEVIATION = 0.5
# Steps of the first differences, before any slope is known: over the second one contacts pass
# samples with a strong unknown, and over the first one a weak unknown shows nothing.
FIRST_DIFFERENCE, SECOND_DIFFERENCE = 1e-8, 1e-5
# Norm of a change that is made of last digits.
ROUNDING_NORM = 1e-8
# Share of the distance of its bounds within which an unknown is at one.
AT_BOUND = 1e-5


@dataclass
class SimulatedProblem:
    """Residuals and Jacobians of all runs at z, each simulated once.

    secants : slopes of the last point, and which of them are not differenced
    lengths : of the slopes, which tell the steps of the next ones, shape (unknowns,); NaN where
        they are not known yet
    difference : norm of the change of the residual vector that slopes are taken over
    bounding : whether the leverage of samples is bounded
    """

    unknowns: tuple[Unknown, ...]
    residuals: Sequence[Residual]
    progress: Callable[[float], None] | None
    secants: SecantSlopes
    lengths: Array
    difference: float = DIFFERENCE_NORM
    simulations: int = 0
    known: tuple[bytes, list[Array]] = (b"", [])
    based: tuple[bytes, list[Array]] = (b"", [])
    slopes_known: tuple[bytes, list[Array]] = (b"", [])
    beside: tuple[bytes, Sequence[tuple[Residual, Array]]] = (b"", ())
    bounding: bool = False

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
        """Take the steps of the differences at z from first slopes where they are not known yet.

        Over FIRST_DIFFERENCE the slope of a weak parameter may be lost in last digits.
        """
        first = [np.zeros((*r.shape, len(z))) for r in self.residual(z)]
        unknown = np.isnan(self.lengths)
        for j in np.flatnonzero(unknown):
            self._difference(z, int(j), FIRST_DIFFERENCE, first)
        self._difference_again(z, unknown, first)
        self.lengths = np.where(unknown, column_lengths(first), self.lengths)

    def _jacobian(self, z: Array) -> list[Array]:
        base = self.residual(z)
        self.based = z.tobytes(), base
        differenced = self.secants.differenced(z, base)
        jacobians = self.secants.copies(base)
        steps = self._steps(self.difference, LARGEST_DIFFERENCE)
        for j in np.flatnonzero(differenced):
            self._difference(z, int(j), steps[j], jacobians)
        self._difference_again(z, differenced & np.isnan(self.lengths), jacobians)
        # Where no step was known, the slopes only tell the next steps, and are not followed.
        if np.isfinite(self.lengths).any() or self.secants.followed.any():
            self.secants.move(z, base, jacobians, ~differenced)
        self.lengths = column_lengths(jacobians)
        return jacobians

    def _steps(self, norm: float, most: float) -> Array:
        """Steps of z that change the residual vector by a norm, but none larger than `most`."""
        steps = np.clip(norm / self.lengths, SMALLEST_DIFFERENCE, most * max(1.0, norm))
        return np.where(np.isnan(self.lengths), FIRST_DIFFERENCE, steps)

    def _difference(self, z: Array, j: int, step: float, jacobians: Sequence[Array]) -> None:
        """Fill in the column of one unknown."""
        unknown = self.unknowns[j]
        if not unknown.scaled(unknown.lower) <= z[j] + step <= unknown.scaled(unknown.upper):
            step = -step
        changed = z.copy()
        changed[j] += step
        for k in range(len(jacobians)) if unknown.run is None else (unknown.run,):
            self.simulations += 1
            residual, base = self._residuals_beside(z)[k]
            change = residual(_values(self.unknowns, changed, k)) - base
            column = change / (changed[j] - z[j])
            changed_by, length = np.linalg.norm(change), np.linalg.norm(column)
            shown = changed_by > ROUNDING_NORM and length > ROUNDING_SLOPE
            jacobians[k][..., j] = column if shown else 0.0

    def _difference_again(
        self, z: Array, first: NDArray[np.bool_], jacobians: Sequence[Array]
    ) -> None:
        """Fill in those columns of first differences that showed nothing over a longer step."""
        for j in np.flatnonzero(first & (column_lengths(jacobians) < ROUNDING_SLOPE)):
            self._difference(z, int(j), SECOND_DIFFERENCE, jacobians)

    def _residuals_beside(self, z: Array) -> Sequence[tuple[Residual, Array]]:
        """The residual function of each run for values beside z, and what it gives at z.

        A simulation that follows the steps of the one at z may end elsewhere than that, which
        tried others first: by 1e-4 of the noise, and by three times it where a limit chatters. Over
        1e-8 that was a slope of 3e8, the same for all unknowns.
        """
        if self.difference > FOLLOWED_NORM:
            return list(zip(self.residuals, self.residual(z), strict=True))
        if self.beside[0] != z.tobytes():
            own = [self._beside(k, z) for k in range(len(self.residuals))]
            self.beside = z.tobytes(), own
        return self.beside[1]

    def _beside(self, k: int, z: Array) -> tuple[Residual, Array]:
        values = _values(self.unknowns, z, k)
        function = near(self.residuals[k], values)
        if function is self.residuals[k]:
            return function, self.residual(z)[k]
        self.simulations += 1
        return function, function(values)

    def wide_jacobian(self, z: Array) -> list[Array]:
        """Jacobian of every run at z, with the columns of weak unknowns over wider differences."""
        jacobians = [j.copy() for j in self.jacobian(z)]
        wide = self._steps(HIDDEN_NORM, WIDEST_DIFFERENCE)
        for j in np.flatnonzero(wide > LARGEST_DIFFERENCE):
            self._difference(z, int(j), wide[j], jacobians)
        return jacobians

    def symmetric_jacobian(self, z: Array) -> list[Array]:
        """Jacobian of every run at z, over a standard deviation around it."""
        jacobians = [j.copy() for j in self.jacobian(z)]
        back = [np.zeros_like(j) for j in jacobians]
        steps = self._steps(HALF_DEVIATION, WIDEST_DIFFERENCE)
        for j, unknown in enumerate(self.unknowns):
            self._difference(z, j, steps[j], jacobians)
            self._difference(z, j, -steps[j], back)
            for k in range(len(back)) if unknown.run is None else (unknown.run,):
                jacobians[k][..., j] = 0.5 * (jacobians[k][..., j] + back[k][..., j])
        return jacobians

    def rows(self, z: Array) -> Array:
        """All residuals and the priors as one vector."""
        return np.concatenate([*(r.ravel() for r in self.residual(z)), self._prior(z)])

    def turned_rows(self, z: Array) -> Array:
        """`rows`, turned so that all lies along the first axis, shape (2 + unknowns,)."""
        turned = np.zeros(2 + len(z))
        turned[0] = np.linalg.norm(self.rows(z))
        return turned

    def turned_slopes(self, z: Array) -> Array:
        """Jacobian of `rows`, turned with them, shape (2 + unknowns, unknowns).

        It is triangular but for its last row: a rotation changes no product of rows and slopes, of
        which alone a step of least squares is made, and all that it leaves of the samples is this
        factor. Samples of large leverage may have less weight in it, see `bounding_weights`.
        """
        prior = np.diag([1.0 / u.scaled_std for u in self.unknowns])
        parts = [
            np.concatenate([residual[..., None], jacobian], axis=-1)
            for residual, jacobian in zip(self.residual(z), self.jacobian(z), strict=True)
        ]
        if self.bounding:
            slopes = [part[..., 1:].reshape(-1, len(z)) for part in parts]
            weights = bounding_weights(slopes, prior)
            parts = [
                part * own.reshape(part.shape[:2])[..., None]
                for part, own in zip(parts, weights, strict=True)
            ]
        factors = [
            np.column_stack([self._prior(z), prior]),
            *(f for part in parts for f in np.linalg.qr(part, mode="r")),
        ]
        factor = np.asarray(np.linalg.qr(np.concatenate(factors), mode="r"))
        return beside_residual(factor, float(np.linalg.norm(self.rows(z))))

    def promise(self, z: Array) -> float:
        """Fall of the cost that a linear step with bounded leverage promises [chi squared].

        An unknown at its bound goes nowhere.
        """
        lower = np.array([u.scaled(u.lower) for u in self.unknowns])
        upper = np.array([u.scaled(u.upper) for u in self.unknowns])
        margin = AT_BOUND * (upper - lower)
        free = (z > lower + margin) & (z < upper - margin)
        known, self.bounding = self.bounding, True
        slopes = self.turned_slopes(z)[:, free]
        self.bounding = known
        rows = self.turned_rows(z)
        step, *_ = np.linalg.lstsq(slopes, rows)
        return float(rows @ rows - np.sum((rows - slopes @ step) ** 2))

    def _prior(self, z: Array) -> Array:
        return np.array(
            [
                (z[j] - u.scaled(u.prior)) / u.scaled_std if u.std is not None else 0.0
                for j, u in enumerate(self.unknowns)
            ]
        )


def _values(unknowns: Sequence[Unknown], z: Array, run: int) -> dict[str, float]:
    return {u.name: u.value(float(z[j])) for j, u in enumerate(unknowns) if u.run in {None, run}}
