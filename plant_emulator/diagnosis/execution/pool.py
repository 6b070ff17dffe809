"""Execution of the tasks of a diagnosis: in sequence, or in a pool (`workflows.workers`).

A step is a function of a model and one item. A worker gets the recipe of the model instead of the
model, and builds the model once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from plant_emulator.diagnosis.machine import Model

Item = TypeVar("Item")
Answer = TypeVar("Answer")


class Recipe(Protocol):
    """Plain data that build a model; picklable, and equal to their copies."""

    def build(self) -> Model:
        """Build the model."""

    def digest(self) -> str:
        """Hash that only a recipe of the same model shares."""


_MODELS: dict[str, Model] = {}


def build_model(recipe: Recipe) -> Model:
    """Build the model of a recipe, or give the last one that was built from an equal recipe."""
    key = recipe.digest()
    model = _MODELS.get(key)
    if model is None:
        model = recipe.build()
        _MODELS.clear()
        _MODELS[key] = model
    return model  # a worker may have several threads: _MODELS may hold another model by now


class Pool(Protocol):
    """Runs a step for many items, in this process or on others."""

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """Give the answers in the order of the items, each as soon as it is there."""

    def close(self) -> None:
        """End what was started."""


class InProcess:
    """Runs a step for one item after the other in this process."""

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        return (function(build_model(recipe), item) for item in items)

    def close(self) -> None:
        """Do nothing: nothing was started."""


@dataclass(frozen=True, kw_only=True)
class TaskRunner:
    """The pool, the recipe and the fitted runs with which the steps of one diagnosis run.

    recipe : of the model that the steps get
    model : the machine in this process, for what it says of its runs and effects
    runs : numbers of the fitted runs
    """

    pool: Pool
    recipe: Recipe
    model: Model
    runs: tuple[int, ...]

    def map(
        self, function: Callable[[Model, Item], Answer], items: Sequence[Item]
    ) -> Iterator[Answer]:
        """Run a step for these items; give the answers in their order."""
        return self.pool.map(function, self.recipe, items)
