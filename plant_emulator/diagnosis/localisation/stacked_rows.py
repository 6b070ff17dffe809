"""Columns of a linear model in the rows of all runs: relations first, then the drum's speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.localisation.parity_relations import Relations
    from plant_emulator.signals.log import Array

    Columns = Sequence[Array | None]


@dataclass(frozen=True)
class Table:
    """The relations of every run, and the weights of its samples of the drum's speed."""

    relations: Sequence[Relations]
    weights: Sequence[Array]

    def shared(self, relation: Columns, speed: Columns) -> Array:
        """Columns whose coefficients all runs share; None: zeros.

        relation : shape (ROWS, n - 1, k) a run, not whitened; speed : (n, k) a run, over the noise
        """
        width = next(a.shape[-1] for a in (*relation, *speed) if a is not None)
        parts = [
            np.zeros((r.value.size, width)) if a is None else r.white(a)
            for a, r in zip(relation, self.relations, strict=True)
        ]
        parts += [
            np.zeros((len(w), width)) if a is None else a * w[:, None]
            for a, w in zip(speed, self.weights, strict=True)
        ]
        return np.concatenate(parts)

    def own_relations(self, columns: Sequence[Array]) -> Array:
        """Columns of the relations whose coefficients are a run's own."""
        nothing = [None] * len(columns)
        placed = [self.shared(alone(columns, k), nothing) for k in range(len(columns))]
        return np.concatenate(placed, axis=1)

    def own_speed(self, columns: Sequence[Array]) -> Array:
        """Columns of the drum's speed whose coefficients are a run's own."""
        nothing = [None] * len(columns)
        placed = [self.shared(nothing, alone(columns, k)) for k in range(len(columns))]
        return np.concatenate(placed, axis=1)


def alone(columns: Sequence[Array], run: int) -> list[Array | None]:
    """The columns of one run, none of the others."""
    return [own if k == run else None for k, own in enumerate(columns)]
