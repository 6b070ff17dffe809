"""The noise of the logs themselves in every fit: the residual of each channel, made white.

The noise is estimated on the residual of a rich model (`rich_model`), so that no cause of the
library passes for noise. The map is linear and the same for all
hypotheses, because their costs are compared.
"""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from plant_emulator.diagnosis.search.rich_model import rich_columns
from plant_emulator.diagnosis.search.simulation_columns import SimulationColumns
from plant_emulator.estimation.noise.disturbances import outlying
from plant_emulator.estimation.noise.logged_noise import disturbances_of_runs, noise_of_runs
from plant_emulator.estimation.regression import Regression
from plant_emulator.signals.noise import NoiseSeries

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import Recipe
    from plant_emulator.diagnosis.fidelity import Fidelity
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import MeasuredRun, Model
    from plant_emulator.estimation.noise.channel_noise import Whitener
    from plant_emulator.estimation.noise.logged_noise import LoggedNoise
    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.signals.log import Array

    Whiteners = Mapping[int, Sequence[Whitener]]


def estimate_noise(model: Model, task: Task) -> LoggedNoise:
    """Estimate the noise around the fit `task.base` (a step)."""
    simulation = SimulationColumns(model, task.base, task.runs)
    return noise_of_runs(_series(model, simulation))


def find_disturbances(model: Model, task: Task) -> tuple[LoggedNoise | None, LoggedNoise | None]:
    """Find the lines around the fit `task.base`, and lines and outliers (a step).

    None where there are none.
    """
    series = []
    for k, states in zip(task.runs, task.base.states, strict=True):
        rows, run = (
            model.residual(k, task.base.effects)({**task.base.values, **states}),
            model.runs[k],
        )
        for name, row in zip(run.channels, rows, strict=True):
            series.append((k, name, NoiseSeries(time=run.time, value=row, use=row != 0.0)))
    return disturbances_of_runs(series, marked=False), disturbances_of_runs(series)


def _series(model: Model, simulation: SimulationColumns) -> Iterator[tuple[int, str, NoiseSeries]]:
    """Run, channel and residual of the rich model, for every channel of every run."""
    columns = [simulation.data.nuisance, *rich_columns(model.candidates, simulation)]
    rest = Regression.of(simulation.data.y, np.concatenate(columns, axis=1)).left
    first = 0
    for k, residual in zip(simulation.runs, simulation.found.residuals, strict=True):
        run = model.runs[k]
        part = rest[first : first + residual.size].reshape(residual.shape)
        first += residual.size
        for name, row, counted in zip(run.channels, part, residual != 0.0, strict=True):
            yield k, name, NoiseSeries(time=run.time, value=row, use=counted)


class _WhitenedModel:
    """A model whose residuals are white in its logs' own noise; all else is the plain model's."""

    def __init__(self, model: Model, noise: LoggedNoise) -> None:
        self._model, self.noise = model, noise
        self.runs = [self._with_noise(run) for run in model.runs]

    def _with_noise(self, run: MeasuredRun) -> MeasuredRun:
        """A run with the deviation of the logs' own noise."""
        levels = [self.noise.channels[name].total_deviation for name in run.channels]
        return replace(run, noise=run.noise * np.array(levels))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Model:
        """See `Model`; the planned runs follow the model's own, and are not whitened."""
        return cast("Model", _WhitenedModel(self._model.with_planned_runs(where, runs), self.noise))

    def rough(self) -> Model:
        """See `Model`."""
        return cast("Model", _WhitenedModel(self._model.rough(), self.noise))

    def observer(self, interval: float) -> Model:
        """See `Model`."""
        return cast("Model", _WhitenedModel(self._model.observer(interval), self.noise))

    def relations(
        self, where: FitResult, runs: Sequence[int], whiteners: Whiteners | None = None
    ) -> Fidelity | None:
        """See `Model`; the whiteners are those of this noise."""
        return self._model.relations(where, runs, whiteners or self.noise.whiteners)

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        plain, found = self._model.residual(run, effects), self.noise.whiteners.get(run)
        if found is None:
            return plain

        def residual(values: Mapping[str, float]) -> Array:
            rows = plain(values)
            return np.stack([w.white(row) for w, row in zip(found, rows, strict=True)])

        return residual

    def unwhitened_residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`; samples that are outliers do not count."""
        plain, found = self._model.unwhitened_residual(run, effects), self.noise.whiteners.get(run)
        level = self._model.runs[run].noise / self.runs[run].noise

        def residual(values: Mapping[str, float]) -> Array:
            rows = plain(values) * level[:, None]
            if found is None:
                return np.where([outlying(row, row != 0.0) for row in rows], 0.0, rows)
            return np.where([w.use for w in found], rows, 0.0)

        return residual


@dataclass(frozen=True)
class WhitenedRecipe:
    """The recipe of a model that is whitened for its logs' own noise."""

    recipe: Recipe
    noise: LoggedNoise

    def build(self) -> Model:
        """Build the model."""
        return cast("Model", _WhitenedModel(self.recipe.build(), self.noise))

    def digest(self) -> str:
        """Hash of the plain recipe and of the noise."""
        own = hashlib.sha256(self.recipe.digest().encode())
        own.update(pickle.dumps(dict(self.noise.channels)))
        for run, whiteners in sorted(self.noise.whiteners.items()):
            for one in whiteners:
                own.update(f"{run} {one.lines}".encode() + one.use.tobytes())
        return own.hexdigest()
