"""Which effects the runs can show, and how much one of its plausible size would change them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.screening.simulation_columns import SimulationColumns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Candidate, Model


@dataclass(frozen=True, kw_only=True)
class Visibility:
    """The visibility of an effect of its plausible size in the runs of a fit.

    total_norm : of the change of the simulation's residual
    orthogonal_norm : of the part that no nuisance parameter can follow
    confounded_with : nuisance parameter that follows the change most
    """

    orthogonal_norm: float = 0.0
    total_norm: float = 0.0
    confounded_with: str = ""


def visibilities(model: Model, task: Task) -> dict[str, Visibility]:
    """Compute the visibility of each effect in the runs of `task.base` (a task)."""
    simulation = SimulationColumns(model, task.base, task.runs)
    seen = visible(model, replace(task.base, effects=()), task.runs)
    return {
        name: _visibility(simulation, one) if name in seen else Visibility()
        for name, one in model.candidates.items()
    }


def _visibility(simulation: SimulationColumns, candidate: Candidate) -> Visibility:
    states = [{u.name: u.start for u in candidate.states} for _ in simulation.runs]
    column = simulation.column(candidate.name, values_at_size(candidate, 1.0), states)
    if column is None or not column.any():
        return Visibility()
    square = float(simulation.data.products(column[:, None]).gram[0, 0])
    return Visibility(
        orthogonal_norm=float(np.sqrt(max(0.0, square))),
        total_norm=float(np.linalg.norm(column)),
        confounded_with=simulation.confounded_with(column),
    )


def _library(model: Model, base: FitResult) -> dict[str, Candidate]:
    """Effects that a fit lacks and that columns can show."""
    return {
        name: one
        for name, one in model.candidates.items()
        if name not in base.effects and not one.stochastic
    }


def visible(model: Model, base: FitResult, runs: Sequence[int]) -> dict[str, Candidate]:
    """Effects that a fit lacks and that a run can show."""
    hidden = frozenset.intersection(*(model.runs[k].hides for k in runs))
    return {name: one for name, one in _library(model, base).items() if name not in hidden}
