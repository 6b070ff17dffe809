"""The noise of fed inputs as part of the noise, in every fit of a contest; see `fed_noise`.

Its directions are those at the fit without effects, which is where a gap closes when it does in the
log. They are the same for all fits, whose costs are compared.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from plant_emulator.diagnosis.fitting.steps import refit, start
from plant_emulator.diagnosis.fitting.task import Task

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.recordings.input_noise import NoiseDirections
    from plant_emulator.signals.log import Array


def whiten_inputs(
    pool: Pool, recipe: Recipe, model: Model, runs: tuple[int, ...]
) -> tuple[Recipe, FitResult | None]:
    """The recipe of a model whose residuals have white noise also where inputs are fed.

    The recipe itself where these runs feed none, or none that counts; and the fit without effects
    by it, None where none was needed.
    """
    if not any(model.runs[run].measured_input for run in runs):
        return recipe, None
    (null,) = pool.map(start, recipe, [runs])
    (found,) = pool.map(find_input_noise, recipe, [Task(base=null, runs=runs)])
    if not found:
        return recipe, null
    quiet = InputNoiseRecipe(recipe, found)
    (null,) = pool.map(refit, quiet, [Task(base=null, runs=runs)])
    return quiet, null


def find_input_noise(model: Model, task: Task) -> dict[int, NoiseDirections]:
    """Step of a diagnosis: what the noise of fed inputs does to the runs of a fit, by run."""
    fed = [
        (run, model.input_noise(run, task.base, state))
        for run, state in zip(task.runs, task.base.states, strict=True)
        if model.runs[run].measured_input
    ]
    return {run: found for run, found in fed if found is not None}


class _InputNoiseModel:
    """A model whose residuals are whitened; all else as it is."""

    def __init__(self, model: Model, noise: Mapping[int, NoiseDirections]) -> None:
        self._model, self._noise = model, noise

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Model:
        """See `Model`; the planned runs come behind its own, whose noise stays as it is."""
        return cast(
            "Model", _InputNoiseModel(self._model.with_planned_runs(where, runs), self._noise)
        )

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        plain, found = self._model.residual(run, effects), self._noise.get(run)
        if found is None:
            return plain

        def residual(values: Mapping[str, float]) -> Array:
            return found.whitened(plain(values))

        return residual


@dataclass(frozen=True)
class InputNoiseRecipe:
    """What builds a model whose residuals are whitened; noise : by run."""

    recipe: Recipe
    noise: Mapping[int, NoiseDirections]

    def build(self) -> Model:
        """The model."""
        return cast("Model", _InputNoiseModel(self.recipe.build(), self.noise))

    def digest(self) -> str:
        """The same for the same model only."""
        own = hashlib.sha256(self.recipe.digest().encode())
        for run, found in sorted(self.noise.items()):
            sparse = found.directions
            own.update(f"{run} {sparse.shape}".encode())
            for part in (sparse.data, sparse.indices, sparse.indptr, found.deviations):
                own.update(part.tobytes())
        return own.hexdigest()
