"""Columns of a linear model over the stacked rows of all runs.

The parity relations of all runs come first, then the drum speeds of all runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.localisation.parity_relations import WhitenedRelations
    from plant_emulator.signals.log import Array

    Columns = Sequence[Array | None]


@dataclass(frozen=True)
class StackedRows:
    """The stacked rows: parity relations of each run, and weights of its drum speed samples."""

    relations: Sequence[WhitenedRelations]
    weights: Sequence[Array]

    def shared_columns(self, relation: Columns, speed: Columns) -> Array:
        """Columns whose coefficients all runs share, whitened, shape (rows, k).

        relation : of each run's relations, shape (ROWS, n - 1, k), not whitened; None: zeros
        speed : of each run's drum speed, shape (n, k), over its noise; None: zeros
        """
        width = next(a.shape[-1] for a in (*relation, *speed) if a is not None)
        parts = [
            np.zeros((r.value.size, width)) if a is None else r.whiten(a)
            for a, r in zip(relation, self.relations, strict=True)
        ]
        parts += [
            np.zeros((len(w), width)) if a is None else a * w[:, None]
            for a, w in zip(speed, self.weights, strict=True)
        ]
        return np.concatenate(parts)

    def own_relations(self, columns: Sequence[Array]) -> Array:
        """Columns of the relations with coefficients of each run's own, whitened."""
        nothing = [None] * len(columns)
        placed = [self.shared_columns(only_run(columns, k), nothing) for k in range(len(columns))]
        return np.concatenate(placed, axis=1)

    def own_speed(self, columns: Sequence[Array]) -> Array:
        """Columns of the drum speed with coefficients of each run's own, weighted."""
        nothing = [None] * len(columns)
        placed = [self.shared_columns(nothing, only_run(columns, k)) for k in range(len(columns))]
        return np.concatenate(placed, axis=1)


def only_run(columns: Sequence[Array], run: int) -> list[Array | None]:
    """The columns of one run, and None for every other run."""
    return [own if k == run else None for k, own in enumerate(columns)]
