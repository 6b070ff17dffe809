"""A quantity that a law may be missing of, with the relations that such a law acts in.

A law of a quantity changes the residuals of the parity relations by its value times a weight. The
sign is that of the model's equations, so that a coefficient is what an effect of that law needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid

from plant_emulator.diagnosis.localisation.parity_relations import ROWS
from plant_emulator.diagnosis.missing_law.states import LawState

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.localisation.block_basis import BlockQuantities
    from plant_emulator.diagnosis.localisation.marginal_likelihood import LinearModel
    from plant_emulator.signals.log import Array

# Samples that a turn of the fastest ripple has on average.
SAMPLES_A_TURN = 2.0
# Largest multiple that is looked for: the teeth of a wheel.
LARGEST_MULTIPLE = 40.0


@dataclass(frozen=True, kw_only=True, eq=False)
class LawQuantity:
    """A quantity that a law may be missing of.

    place : subsystem; name : in words; unit : of the law
    hook : what an effect with the law changes: a law of the bench (`model/laws.py`); of an axis
        the columns of its regression
    states : that a law may depend on
    """

    place: str
    name: str
    unit: str
    hook: str
    states: tuple[LawState, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class BenchQuantity(LawQuantity):
    """A quantity of the bench.

    rows : run and values of laws over its intervals, shape (n - 1, k), to their columns in the
        relations, shape (ROWS, n - 1, k), and in the drum speed over its noise, shape (n, k), or
        None
    model : linear model that the columns belong to
    """

    rows: Callable[[int, Array], tuple[Array, Array | None]]
    model: LinearModel


def rows_in_relations(
    weights: Mapping[int, float | Sequence[Array]],
) -> Callable[[int, Array], tuple[Array, None]]:
    """Rows of a law that acts in these relations only; weights : one, or those of every run."""

    def rows(run: int, values: Array) -> tuple[Array, None]:
        own = {row: _of_run(weight, run) for row, weight in weights.items()}
        return in_relations(own, values), None

    return rows


def _of_run(weight: float | Sequence[Array], run: int) -> Array:
    return np.asarray(weight if isinstance(weight, float) else weight[run][:, None])


def in_relations(weights: Mapping[int, Array | float], values: Array) -> Array:
    """Columns of values times weights in the relations of a run, shape (ROWS, n - 1, k)."""
    rows = np.zeros((ROWS, *values.shape))
    for row, weight in weights.items():
        rows[row] = weight * values
    return rows


def time_of(q: Sequence[BlockQuantities]) -> LawState:
    """Time since the start of every run as a state."""
    return LawState(
        name="time",
        symbol="t",
        unit="s",
        code="s.time",
        kind="time",
        values=[one.time - one.time[0] for one in q],
        time=[one.time for one in q],
    )


def angle_of(
    q: Sequence[BlockQuantities], speeds: Sequence[Array], name: str, code: str
) -> LawState:
    """Angle of a shaft as a state; speeds : of the shaft in every run [rad/s].

    The scan ends where a ripple has SAMPLES_A_TURN on average, or at LARGEST_MULTIPLE.
    """
    angles = [
        cumulative_trapezoid(speed, one.time, initial=0)
        for one, speed in zip(q, speeds, strict=True)
    ]
    steps = np.concatenate([np.abs(np.diff(one)) for one in angles])
    return LawState(
        name=name,
        symbol="theta",
        unit="rad",
        code=code,
        kind="angle",
        values=angles,
        time=[one.time for one in q],
        scanned=min(LARGEST_MULTIPLE, float(2.0 * np.pi / SAMPLES_A_TURN / np.mean(steps))),
    )
