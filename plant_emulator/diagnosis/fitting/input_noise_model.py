"""A model whose residuals are whitened for the noise of its measured inputs.

An input that is measured brings its noise into the simulation, and so does one that a hole of the
log hides, or whose rows were taken early or late. `recordings.input_noise` finds the directions of
the residual that this noise disturbs. They are found once, at the fit without effects, and stay the
same for every fit, because the costs of the fits are compared.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from plant_emulator.diagnosis.fitting.fit_steps import refit
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.estimation.residuals import whiten_function

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import Recipe, TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.recordings.input_noise import NoiseDirections


def whiten_inputs(runner: TaskRunner, null: FitResult) -> tuple[TaskRunner, FitResult]:
    """Give a runner whose model is whitened for input noise, and the fit without effects there.

    Both stay as they are where no input of the fitted runs is uncertain, or where the noise of the
    inputs does not count.
    """
    if not any(runner.model.runs[run].uncertain_inputs for run in runner.runs):
        return runner, null
    (found,) = runner.map(find_input_noise, [Task(base=null, runs=runner.runs)])
    if not found:
        return runner, null
    whitened = replace(runner, recipe=InputNoiseRecipe(runner.recipe, found))
    (null,) = whitened.map(refit, [Task(base=null, runs=runner.runs)])
    return whitened, null


def find_input_noise(model: Model, task: Task) -> dict[int, NoiseDirections]:
    """Find the directions of the residual that input noise disturbs at a fit, by run (a step).

    Runs that are only predicted have them too; their states are searched for.
    """
    base = task.base
    states = dict(zip(task.runs, base.states, strict=True))
    found = {
        k: model.input_noise(
            k, base, states.get(k) or model.initial_states(k, base.effects, base.values)
        )
        for k, run in enumerate(model.runs)
        if run.uncertain_inputs
    }
    return {run: noise for run, noise in found.items() if noise is not None}


class _InputNoiseModel:
    """A model with whitened residuals; everything else is the plain model's."""

    def __init__(self, model: Model, noise: Mapping[int, NoiseDirections]) -> None:
        self._model, self._noise = model, noise

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Model:
        """See `Model`; the planned runs follow the model's own, and are not whitened."""
        return cast(
            "Model", _InputNoiseModel(self._model.with_planned_runs(where, runs), self._noise)
        )

    def observer(self, interval: float) -> Model:
        """See `Model`."""
        return cast("Model", _InputNoiseModel(self._model.observer(interval), self._noise))

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        return whiten_function(self._model.residual(run, effects), self._noise.get(run))

    def unwhitened_residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`, but what the noise of an input makes of a run is no gap: it is whitened."""
        return whiten_function(self._model.unwhitened_residual(run, effects), self._noise.get(run))


@dataclass(frozen=True)
class InputNoiseRecipe:
    """The recipe of a model that is whitened for input noise; noise : by run."""

    recipe: Recipe
    noise: Mapping[int, NoiseDirections]

    def build(self) -> Model:
        """Build the model."""
        return cast("Model", _InputNoiseModel(self.recipe.build(), self.noise))

    def digest(self) -> str:
        """Hash of the plain recipe and of the noise directions."""
        own = hashlib.sha256(self.recipe.digest().encode())
        for run, found in sorted(self.noise.items()):
            sparse = found.directions
            own.update(f"{run} {sparse.shape}".encode())
            for part in (sparse.data, sparse.indices, sparse.indptr, found.deviations, found.known):
                own.update(b"" if part is None else part.tobytes())
        return own.hexdigest()
