"""Slopes of a fit that follow its steps by secants instead of being differenced (pure)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.unknowns import column_lengths

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.estimation.unknowns import Estimate, Unknown
    from plant_emulator.signals.log import Array

# Change of the residual vector that the noise hides [norm]: the slopes of weak parameters are taken
# over it, and slopes that follow by secants may miss it.
HIDDEN_NORM = 0.3
# Share of the change of the residual vector that the slopes may miss in a step that they follow by
# secants.
MISSED_SHARE = 0.2


class SecantSlopes:
    """Slopes that follow the residual by secants (Broyden, Math. Comp. 19 (1965) 577).

    The residual of a run does not know the states of another run; its slopes follow without them
    (Schubert, Math. Comp. 24 (1970) 27).

    followed : columns that are never differenced, shape (unknowns,); they begin as those of another
        estimate
    rough : whether the other columns follow too after a step that all predicted well
    """

    def __init__(
        self, unknowns: Sequence[Unknown], other: Estimate | None = None, *, rough: bool = False
    ) -> None:
        column = {} if other is None else {(u.name, u.run): j for j, u in enumerate(other.unknowns)}
        self.followed = np.array([(u.name, u.run) in column for u in unknowns])
        self.rough = rough
        self._run_of = [u.run for u in unknowns]
        wanted = [column[u.name, u.run] for u in unknowns if (u.name, u.run) in column]
        self._begun = None if other is None else [j[..., wanted] for j in other.jacobians]
        self._last: tuple[Array, Sequence[Array], Sequence[Array]] | None = None

    def differenced(self, z: Array, residuals: Sequence[Array]) -> NDArray[np.bool_]:
        """Columns to difference at z, shape (unknowns,)."""
        if self._last is not None and self.rough:
            before, old, slopes = self._last
            changes = [now - then for now, then in zip(residuals, old, strict=True)]
            missed = [c - j @ (z - before) for c, j in zip(changes, slopes, strict=True)]
            if _norm(missed) <= max(HIDDEN_NORM, MISSED_SHARE * _norm(changes)):
                return np.zeros_like(self.followed)
        return ~self.followed

    def copies(self, residuals: Sequence[Array]) -> list[Array]:
        """Slopes as they were at the last point; 0 in columns that were never differenced."""
        if self._last is not None:
            return [j.copy() for j in self._last[2]]
        found = [np.zeros((*r.shape, len(self.followed))) for r in residuals]
        if self._begun is not None:
            for jacobian, begun in zip(found, self._begun, strict=True):
                jacobian[..., self.followed] = begun
        return found

    def move(
        self,
        z: Array,
        residuals: Sequence[Array],
        jacobians: Sequence[Array],
        kept: NDArray[np.bool_],
    ) -> None:
        """Let the kept columns follow the step to z, beside the others, which are those at z."""
        if self._last is not None:
            before, old, slopes = self._last
            step = z - before
            squares = column_lengths(jacobians) ** 2
            for k, jacobian in enumerate(jacobians):
                own = kept & np.array([run in {None, k} for run in self._run_of])
                weight = squares[own] * step[own]
                length = float(weight @ step[own])
                if length > 0.0:
                    missed = residuals[k] - old[k] - 0.5 * (slopes[k] + jacobian) @ step
                    jacobian[..., own] += missed[..., None] * (weight / length)
        self._last = z.copy(), list(residuals), list(jacobians)


def _norm(residuals: Sequence[Array]) -> float:
    return float(np.sqrt(sum(np.vdot(r, r) for r in residuals)))
