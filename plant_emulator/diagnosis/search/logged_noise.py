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

from plant_emulator.diagnosis.screening.rich_model import rich_columns
from plant_emulator.diagnosis.screening.simulation_columns import SimulationColumns
from plant_emulator.estimation.nearby import Changed
from plant_emulator.estimation.noise.disturbances import outlying
from plant_emulator.estimation.noise.logged_noise import disturbances_of_runs, noise_of_runs
from plant_emulator.estimation.regression import Regression
from plant_emulator.signals.noise import NoiseSeries

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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
    residuals = [
        model.residual(k, task.base.effects)({**task.base.values, **states})
        for k, states in zip(task.runs, task.base.states, strict=True)
    ]
    series = _of_channels(model, task.runs, residuals, residuals)
    return disturbances_of_runs(series, marked=False), disturbances_of_runs(series)


def _series(model: Model, simulation: SimulationColumns) -> list[tuple[int, str, NoiseSeries]]:
    """Run, channel and residual of the rich model, for every channel of every run.

    The columns are fitted beside the lines, which stay in the residual: a double of the mains that
    sampling folds to a slow wave would lend itself to the columns, and leave their shape as colour.
    """
    residuals = simulation.found.residuals
    series = _of_channels(model, simulation.runs, residuals, residuals)
    known = disturbances_of_runs(series, marked=False)
    columns = [simulation.data.nuisance, *rich_columns(model.candidates, simulation)]
    both = np.concatenate([simulation.data.y[:, None], *columns], axis=1)
    beside = both if known is None else _beside_lines(both, model, simulation.runs, known)
    found = Regression.of(beside[:, 0], beside[:, 1:]).mean
    rest = both[:, 0] - both[:, 1:] @ found
    ends = np.cumsum([r.size for r in residuals])[:-1]
    parts = [p.reshape(r.shape) for p, r in zip(np.split(rest, ends), residuals, strict=True)]
    return _of_channels(model, simulation.runs, parts, residuals)


def _of_channels(
    model: Model, runs: Sequence[int], values: Sequence[Array], residuals: Sequence[Array]
) -> list[tuple[int, str, NoiseSeries]]:
    """Run, channel and values, for every channel of every run; a residual of 0 does not count."""
    return [
        (k, name, NoiseSeries(time=model.runs[k].time, value=row, use=residual != 0.0))
        for k, rows, others in zip(runs, values, residuals, strict=True)
        for name, row, residual in zip(model.runs[k].channels, rows, others, strict=True)
    ]


def _beside_lines(both: Array, model: Model, runs: Sequence[int], known: LoggedNoise) -> Array:
    """Data and columns of all channels of all runs, whitened for the lines.

    both : shape (n, k), as the result
    """
    found, first = both.copy(), 0
    for k in runs:
        for whitener in known.whiteners[k]:
            own = slice(first, first := first + len(model.runs[k].time))
            if whitener.lines:
                found[own] = np.stack([whitener.white(c) for c in both[own].T], axis=-1)
    return found


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
        plain = self._model.residual(run, effects)
        return self.noise.whitened(run, plain) if run in self.noise.whiteners else plain

    def unwhitened_residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`; samples that are outliers do not count."""
        found = self.noise.whiteners.get(run)
        level = self._model.runs[run].noise / self.runs[run].noise

        def scaled(rows: Array) -> Array:
            rows = rows * level[:, None]
            if found is None:
                return np.where([outlying(row, row != 0.0) for row in rows], 0.0, rows)
            return np.where([w.use for w in found], rows, 0.0)

        return Changed(self._model.unwhitened_residual(run, effects), scaled)


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
