"""Pools that run the steps of a diagnosis on local processes or on a Dask cluster."""

from __future__ import annotations

import os
from concurrent.futures import BrokenExecutor, CancelledError, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeVar

from threadpoolctl import threadpool_limits

from plant_emulator.diagnosis.execution.pool import InProcess, build_model
from plant_emulator.errors import EmulatorError, InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.machine import Model

Item = TypeVar("Item")
Answer = TypeVar("Answer")


def _run_step(function: Callable[[Model, Any], Any], recipe: Recipe, item: Any) -> Any:
    with threadpool_limits(1):  # the threads of several workers would wait for each other
        return function(build_model(recipe), item)


@contextmanager
def _report_loss(
    errors: tuple[type[Exception], ...], advice: str, argument: str = ""
) -> Iterator[None]:
    """Turn the errors of a lost worker into an EmulatorError of one line."""
    try:
        yield
    except errors as error:
        raise EmulatorError(
            f"{advice} ({type(error).__name__}: {error})", argument=argument
        ) from error


def end_with_parent() -> None:
    """Let this worker process end when its parent process ends.

    A killed parent closes no queue. Without this its workers would compute or wait for ever.
    """
    Thread(target=_exit_after_parent, name="end with parent", daemon=True).start()


def _exit_after_parent() -> None:
    if (parent := parent_process()) is not None:
        parent.join()
    os._exit(1)  # sys.exit would end this thread only


class Processes:
    """Runs steps on several processes of this machine."""

    def __init__(self, workers: int) -> None:
        # Spawned and not forked, because a fork copies the locks of threads but not the threads.
        self._executor = ProcessPoolExecutor(
            workers, get_context("spawn"), initializer=end_with_parent
        )
        self._watched = partial(
            _report_loss,
            (BrokenExecutor,),
            f"one of {workers} processes ended before its answer, as when memory runs out; fewer "
            "workers need less",
        )

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        count = len(items)
        with self._watched():
            answers = self._executor.map(_run_step, [function] * count, [recipe] * count, items)
        return self._each(answers)

    def _each(self, answers: Iterator[Answer]) -> Iterator[Answer]:
        with self._watched():
            yield from answers

    def close(self) -> None:
        """End the processes."""
        self._executor.shutdown(cancel_futures=True)


class Cluster:
    """Runs steps on the workers of a Dask scheduler; address : such as tcp://host:8786.

    Raises InputError for an address that cannot be, and EmulatorError where no scheduler answers.
    """

    def __init__(self, address: str) -> None:
        try:
            import distributed
            from distributed.comm.addressing import parse_address, parse_host_port
            from distributed.comm.core import CommClosedError
            from distributed.comm.registry import get_backend
        except ImportError as error:
            raise EmulatorError(
                f"{address}: {error}; pip install 'road-load-bench[cluster]' brings it",
                argument="scheduler",
            ) from error
        try:  # before the client starts its thread, which an error would leave behind
            scheme, place = parse_address(address)
            get_backend(scheme)
            parse_host_port(place)
        except ValueError as error:
            raise InputError(
                f"{address}: {error}; an address like tcp://host:8786 is expected",
                argument="scheduler",
            ) from error
        try:
            self._client: Any = distributed.Client(address, timeout=10)  # type: ignore[no-untyped-call]  # Dask declares none here
        except OSError as error:
            raise EmulatorError(
                f"{address}: no scheduler answers ({error})", argument="scheduler"
            ) from error
        self._recipes: dict[str, Any] = {}
        self._watched = partial(
            _report_loss,
            (distributed.KilledWorker, CommClosedError, CancelledError),
            f"{address}: a worker or the scheduler ended before its answer",
            "scheduler",
        )

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        with self._watched():
            shared = self._share(recipe)
            futures = [
                self._client.submit(_run_step, function, shared, item, pure=False) for item in items
            ]
        return self._each(futures)

    def _each(self, futures: Sequence[Any]) -> Iterator[Any]:
        with self._watched():
            for future in futures:
                yield future.result()

    def _share(self, recipe: Recipe) -> Any:
        """Send the recipe to the workers once, and keep it there.

        A recipe that is freed after a step and sent again for the next step has the same name. Dask
        may then free it late, with the steps that wait for it.
        """
        key = recipe.digest()
        if key not in self._recipes:
            self._recipes[key] = self._client.scatter(recipe, broadcast=True, hash=False)
        return self._recipes[key]

    def close(self) -> None:
        """Free the recipes and leave the cluster."""
        self._recipes.clear()
        self._client.close()


def make_pool(workers: int, scheduler: str | None = None) -> Pool:
    """Make a pool of so many processes, or of a Dask scheduler's workers where one is given."""
    if scheduler is not None:
        return Cluster(scheduler)
    return Processes(workers) if workers > 1 else InProcess()
