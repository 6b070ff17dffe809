"""Where the steps of a diagnosis run: here, on local processes, or on a Dask cluster.

A step is a function of a model and one item. The model goes to each worker once, as the recipe that
builds it.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from plant_emulator.errors import EmulatorError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from plant_emulator.diagnosis.model import Model

Item = TypeVar("Item")
Answer = TypeVar("Answer")


class Recipe(Protocol):
    """What builds a model; picklable, and equal to its copies."""

    def build(self) -> Model:
        """The model."""

    def digest(self) -> str:
        """The same for the same model only."""


_MODELS: dict[str, Model] = {}


def model_of(recipe: Recipe) -> Model:
    """The recipe's model, built once in this process; older ones are let go."""
    key = recipe.digest()
    if key not in _MODELS:
        _MODELS.clear()
        _MODELS[key] = recipe.build()
    return _MODELS[key]


def _run(work: tuple[Callable[[Model, Any], Any], Recipe, Any]) -> Any:
    function, recipe, item = work
    return function(model_of(recipe), item)


class Pool(Protocol):
    """Runs a step for many items; answers in the items' order, each as soon as it is there."""

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """The answers."""

    def close(self) -> None:
        """End what was started."""


class Here:
    """One after the other in this process."""

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        return (function(model_of(recipe), item) for item in items)

    def close(self) -> None:
        """Nothing was started."""


class Processes:
    """On so many processes of this machine."""

    def __init__(self, workers: int) -> None:
        # spawned, not forked: a fork copies the locks of threads that it does not copy
        self._executor = ProcessPoolExecutor(workers, get_context("spawn"))

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        return self._executor.map(_run, [(function, recipe, item) for item in items])

    def close(self) -> None:
        """End the processes."""
        self._executor.shutdown(cancel_futures=True)


class Cluster:
    """On the workers of a Dask scheduler at that address."""

    def __init__(self, address: str) -> None:
        try:
            import distributed
        except ImportError as error:
            raise EmulatorError(
                f"--scheduler {address}: {error}; pip install 'road-load-bench[cluster]' brings it"
            ) from error
        try:
            self._client: Any = distributed.Client(address, timeout=10)  # type: ignore[no-untyped-call]
        except (OSError, ValueError) as error:
            raise EmulatorError(f"--scheduler {address}: no scheduler answers ({error})") from error

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        shared = self._client.scatter(recipe, broadcast=True)
        futures = [self._client.submit(_step, function, shared, item, pure=False) for item in items]
        return (future.result() for future in futures)

    def close(self) -> None:
        """Leave the cluster."""
        self._client.close()


def _step(function: Callable[[Model, Any], Any], recipe: Recipe, item: Any) -> Any:
    return function(model_of(recipe), item)


def pool_of(workers: int, scheduler: str | None = None) -> Pool:
    """The pool that the options --workers and --scheduler ask for."""
    if scheduler is not None:
        return Cluster(scheduler)
    return Processes(workers) if workers > 1 else Here()
