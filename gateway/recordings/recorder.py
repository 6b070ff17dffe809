"""The recorder's own process: takes records from a pipe, appends them to the recording, shows them.

The loop writes each record into the pipe without waiting (a record is smaller than PIPE_BUF, so it
goes in whole or not at all, and what does not go in is counted). When the loop ends, however it
ends, the pipe is at its end: the recorder writes what is still in it and closes the file. So a
gateway that is killed loses no tick. Ctrl-C reaches both processes; the recorder ignores it,
because the ramp-down has to be recorded too.
"""

import fcntl
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from io import FileIO
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from gateway.cycle.record import Layout
from gateway.errors import GatewayError
from gateway.recordings.recording import RecordingError, encode_header
from gateway.recordings.screen import View

BATCH: Final = 0.05
"""[s] Records are written this often."""
SYNC: Final = 1.0
"""[s] And are on the disk this often."""
PIPE_SIZE: Final = 1 << 20
"""Some 10 s of records at 100 Hz: as long may the disk be busy before a record is dropped."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """What the recorder's process is told: where to write, in which form, and whether to show."""

    path: Path
    header: dict[str, Any]
    layout: Layout
    view: bool = False


class Recorder:
    """The loop's end of the pipe. `failed`: the other process has ended before its time."""

    def __init__(self, job: Job) -> None:
        _create(job)
        context = multiprocessing.get_context("spawn")
        receiver, self._sender = context.Pipe(duplex=False)
        with suppress(OSError):
            fcntl.fcntl(self._sender.fileno(), fcntl.F_SETPIPE_SZ, PIPE_SIZE)
        os.set_blocking(self._sender.fileno(), False)
        self._process = context.Process(target=record, args=(receiver, job), name="recorder")
        with _signals_held():
            self._process.start()
        receiver.close()
        self.path = job.path
        self.dropped = 0
        self.failed = False

    def push(self, record: bytes) -> None:
        """Hand over one record; never waits."""
        try:
            os.write(self._sender.fileno(), record)
        except BlockingIOError:
            self.dropped += 1
        except BrokenPipeError:
            self.failed = True

    def close(self) -> None:
        """End the recording; returns when it is on the disk."""
        self._sender.close()
        self._process.join()
        code = self._process.exitcode
        if code:
            # 1 is an error of ours, a negative one a signal; the others are what a write met.
            why = os.strerror(code) if code > 1 else f"exit code {code}"
            raise GatewayError(
                f"{self.path}: the recorder ended early: {why}; expected room on the disk"
            )


@contextmanager
def _signals_held() -> Iterator[None]:
    """The new process inherits the mask: a Ctrl-C while it still starts does not end it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def record(receiver: Connection, job: Job) -> None:
    """The recorder's process: append what comes until the loop's end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    view = View(job.header, job.layout) if job.view else nullcontext(_show_nothing)
    with view as show:
        try:
            _append(receiver, job, show)
        except OSError as error:
            # The loop learns it by its broken pipe, ramps down, and tells the number as words.
            sys.exit(error.errno)


def _append(receiver: Connection, job: Job, show: Callable[[bytes], None]) -> None:
    with job.path.open("ab", buffering=0) as file:
        synced = time.monotonic()
        for batch in _batches(receiver.fileno(), job.layout.size):
            _write(file, batch)
            show(batch)
            if time.monotonic() - synced > SYNC:
                os.fdatasync(file.fileno())
                synced = time.monotonic()
        os.fsync(file.fileno())


def _write(file: FileIO, batch: bytes) -> None:
    """All of it: a disk that fills up takes a part first, and says so only the next time."""
    left = memoryview(batch)
    while left:
        left = left[file.write(left) :]


def _batches(source: int, size: int) -> Iterator[bytes]:
    """Whole records as they come, a few at a time."""
    waiting = b""
    while chunk := os.read(source, PIPE_SIZE):
        waiting += chunk
        whole = len(waiting) // size * size
        yield waiting[:whole]
        waiting = waiting[whole:]
        time.sleep(BATCH)


def _create(job: Job) -> None:
    """Make the file before anything runs: a bad directory is an error at the start."""
    try:
        job.path.parent.mkdir(parents=True, exist_ok=True)
        with job.path.open("xb") as file:
            file.write(encode_header(job.header))
    except OSError as error:
        raise RecordingError(
            error.strerror or "cannot be made",
            file=job.path,
            expected="[recording] dir that can be written",
        ) from error


def _show_nothing(batch: bytes) -> None:
    """Where nobody looks."""
