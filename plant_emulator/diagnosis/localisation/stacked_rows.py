"""Columns of a linear model over the stacked rows of all runs.

The parity relations of all runs come first, then the drum speeds of all runs. A segment of the rows
is what one run has of either. The columns of the unknown laws are kept segment by segment: most are
zero in all segments but one or a few.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.localisation.parity_relations import WhitenedRelations
    from plant_emulator.signals.log import Array

    Columns = Sequence[Array | None]

# Dimensions of the columns of a run's relations, (ROWS, n - 1, k), and of its drum speed, (n, k).
IN_RELATIONS, IN_SPEED = 3, 2


@dataclass(frozen=True, eq=False)
class ColumnGroup:
    """A group of columns, one array a run, not whitened.

    runs : of the relations, shape (ROWS, n - 1, k), or of the drum speed over its noise, (n, k)
    own : whether each run has coefficients of its own
    """

    runs: Sequence[Array]
    own: bool = False

    @property
    def ends(self) -> NDArray[np.int_]:
        """Number of the group's columns up to the last one of each run."""
        widths = np.array([columns.shape[-1] for columns in self.runs])
        return np.cumsum(widths) if self.own else widths


@dataclass(frozen=True, eq=False)
class GroupedColumns:
    """The whitened columns X of groups, in each segment those that it has.

    segments : columns, shape (rows, k), and their numbers among all columns, shape (k,)
    widths : number of columns of each group
    """

    segments: Sequence[tuple[Array, NDArray[np.int_]]]
    widths: Sequence[int]

    @cached_property
    def gram(self) -> Array:
        """X' X."""
        found = np.zeros((sum(self.widths), sum(self.widths)))
        for columns, numbers in self.segments:
            found[np.ix_(numbers, numbers)] += columns.T @ columns
        return found

    def product(self, other: Array) -> Array:
        """X' B; other : B, over all rows, shape (rows, m)."""
        found, end = np.zeros((sum(self.widths), other.shape[1])), 0
        for columns, numbers in self.segments:
            begin, end = end, end + len(columns)
            shown = other[begin:end].any(axis=0)
            found[np.ix_(numbers, shown)] += columns.T @ other[begin:end, shown]
        return found


NO_COLUMNS = GroupedColumns((), ())


@dataclass(frozen=True)
class StackedRows:
    """The stacked rows: parity relations of each run, and weights of its drum speed samples."""

    relations: Sequence[WhitenedRelations]
    weights: Sequence[Array]

    def whiten(self, run: int, columns: Array) -> Array:
        """Whiten columns of a run's relations, or weight columns of its drum speed."""
        if columns.ndim == IN_RELATIONS:
            return self.relations[run].whiten(columns)
        return columns * self.weights[run][:, None]

    def shared_columns(self, relation: Columns, speed: Columns) -> Array:
        """Columns whose coefficients all runs share, whitened, shape (rows, k).

        relation : of each run's relations, shape (ROWS, n - 1, k), not whitened; None: zeros
        speed : of each run's drum speed, shape (n, k), over its noise; None: zeros
        """
        width = next(a.shape[-1] for a in (*relation, *speed) if a is not None)
        counts = [*(r.value.size for r in self.relations), *map(len, self.weights)]
        parts = [
            np.zeros((count, width)) if a is None else self.whiten(k % len(speed), a)
            for k, (count, a) in enumerate(zip(counts, (*relation, *speed), strict=True))
        ]
        return np.concatenate(parts)

    def own_relations(self, columns: Sequence[Array]) -> Array:
        """Columns of the relations with coefficients of each run's own, whitened."""
        from scipy.linalg import block_diag

        nothing = np.zeros((sum(map(len, self.weights)), 0))
        return np.asarray(block_diag(*map(self.whiten, range(len(columns)), columns), nothing))

    def own_speed(self, columns: Sequence[Array]) -> Array:
        """Columns of the drum speed with coefficients of each run's own, weighted."""
        from scipy.linalg import block_diag

        nothing = np.zeros((sum(r.value.size for r in self.relations), 0))
        return np.asarray(block_diag(nothing, *map(self.whiten, range(len(columns)), columns)))

    def grouped(self, groups: Sequence[ColumnGroup]) -> GroupedColumns:
        """All columns of these groups, whitened."""
        widths = [int(group.ends[-1]) for group in groups]
        begins = np.cumsum(widths) - widths
        segments = []
        for dimensions in (IN_RELATIONS, IN_SPEED):
            both = zip(groups, begins, strict=True)
            here = [(g, begin) for g, begin in both if g.runs[0].ndim == dimensions]
            for run in range(len(self.weights)):
                columns = [self.whiten(run, group.runs[run]) for group, _ in here]
                numbers = [
                    begin + group.ends[run] - np.arange(group.runs[run].shape[-1], 0, -1)
                    for group, begin in here
                ]
                segments.append((np.concatenate(columns, axis=1), np.concatenate(numbers)))
        return GroupedColumns(segments, widths)
