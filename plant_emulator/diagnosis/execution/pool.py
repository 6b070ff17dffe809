"""How the steps of a diagnosis are run, one after the other or (see `workers`) side by side.

A step is a function of a model and one item. The model goes to a worker as the recipe that builds
it; a worker builds it once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from plant_emulator.diagnosis.machine import Model

Item = TypeVar("Item")
Answer = TypeVar("Answer")


class Recipe(Protocol):
    """What builds a model; picklable, and equal to its copies."""

    def build(self) -> Model:
        """The model."""

    def digest(self) -> str:
        """The same for the same model only."""


_MODELS: dict[str, Model] = {}


def build_model(recipe: Recipe) -> Model:
    """The recipe's model, built once in this process; older ones are let go."""
    key = recipe.digest()
    model = _MODELS.get(key)
    if model is None:
        model = recipe.build()
        _MODELS.clear()
        _MODELS[key] = model
    return model  # not what stands there by now: a worker may have several threads


class Pool(Protocol):
    """Runs a step for many items; answers in the items' order, each as soon as it is there."""

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """The answers."""

    def close(self) -> None:
        """End what was started."""


class InProcess:
    """One after the other in this process."""

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        return (function(build_model(recipe), item) for item in items)

    def close(self) -> None:
        """Nothing was started."""
