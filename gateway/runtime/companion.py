"""A process beside the loop, which ends with it and which the loop never waits for.

The process gets the reading end of a pipe. The pipe ends when the daemon closes it or dies.
"""

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any, Final

PATIENCE: Final = 2.0
"""[s] Time in which a process may finish its work; on a stalled terminal it cannot."""


class Companion:
    """One process beside the loop: `target(pipe, *arguments)`."""

    def __init__(self, name: str, target: Callable[..., None], *arguments: Any) -> None:
        context = multiprocessing.get_context("spawn")
        receiver, self._sender = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_alone, args=(target, receiver, *arguments), name=name
        )
        with block_signals():
            self._process.start()
        receiver.close()

    def close(self) -> None:
        """End the process; one that does not end in time is killed."""
        self._sender.close()
        self._process.join(PATIENCE)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


@contextmanager
def block_signals() -> Iterator[None]:
    """Block signals while a process starts, so that a Ctrl-C does not end it at once."""
    before = signal.pthread_sigmask(
        signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    )
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _alone(target: Callable[..., None], ended: Connection, *arguments: Any) -> None:
    """Run in the new process: signals of the terminal end the daemon, and the daemon ends this."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    target(ended, *arguments)
