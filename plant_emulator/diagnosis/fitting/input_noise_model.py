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
    from plant_emulator.recordings.input_noise import Loud
    from plant_emulator.signals.log import Array


def quieted(
    pool: Pool, recipe: Recipe, model: Model, runs: tuple[int, ...]
) -> tuple[Recipe, FitResult | None]:
    """The recipe of a model whose residuals have white noise also where inputs are fed.

    The recipe itself where these runs feed none, or none that counts; and the fit without effects
    by it, None where none was needed.
    """
    if not any(model.runs[run].fed for run in runs):
        return recipe, None
    (null,) = pool.map(start, recipe, [runs])
    (found,) = pool.map(louds, recipe, [Task(base=null, runs=runs)])
    if not found:
        return recipe, null
    quiet = Quieted(recipe, found)
    (null,) = pool.map(refit, quiet, [Task(base=null, runs=runs)])
    return quiet, null


def louds(model: Model, task: Task) -> dict[int, Loud]:
    """Step of a diagnosis: what the noise of fed inputs does to the runs of a fit, by run."""
    fed = [
        (run, model.loud(run, task.base, state))
        for run, state in zip(task.runs, task.base.states, strict=True)
        if model.runs[run].fed
    ]
    return {run: found for run, found in fed if found is not None}


class _Quieted:
    """A model whose residuals are quieted; all else as it is."""

    def __init__(self, model: Model, louds: Mapping[int, Loud]) -> None:
        self._model, self._louds = model, louds

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def with_planned(self, where: FitResult, runs: Sequence[int]) -> Model:
        """See `Model`; the planned runs come behind its own, whose noise stays as it is."""
        return cast("Model", _Quieted(self._model.with_planned(where, runs), self._louds))

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        plain, found = self._model.residual(run, effects), self._louds.get(run)
        if found is None:
            return plain

        def residual(values: Mapping[str, float]) -> Array:
            return found.quieted(plain(values))

        return residual


@dataclass(frozen=True)
class Quieted:
    """What builds a model whose residuals are quieted; louds : by run."""

    recipe: Recipe
    louds: Mapping[int, Loud]

    def build(self) -> Model:
        """The model."""
        return cast("Model", _Quieted(self.recipe.build(), self.louds))

    def digest(self) -> str:
        """The same for the same model only."""
        own = hashlib.sha256(self.recipe.digest().encode())
        for run, found in sorted(self.louds.items()):
            sparse = found.directions
            own.update(f"{run} {sparse.shape}".encode())
            for part in (sparse.data, sparse.indices, sparse.indptr, found.deviations):
                own.update(part.tobytes())
        return own.hexdigest()
