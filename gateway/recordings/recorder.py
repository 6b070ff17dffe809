"""The recorder: a process that takes records from a pipe and appends them to the file.

The loop writes each record into the pipe without waiting. A record is smaller than PIPE_BUF, so
that it enters whole or not at all; a record that does not enter is counted. When the loop ends in
any way, the pipe ends, and the recorder writes the records that are still in it. So a killed
gateway loses no tick. Ctrl-C reaches both processes; the recorder ignores it, because it has to
record the ramp-down.
"""

import errno
import fcntl
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

import numpy as np

from gateway.errors import GatewayError, RecordingError
from gateway.recordings.header import Header
from gateway.recordings.parts import Keeping, Parts
from gateway.recordings.triggers import Trips, Wait

BATCH: Final = 0.05
"""[s] Period of writing to the file."""
PATIENCE: Final = 30.0
"""[s] Time in which the last records reach the disk; systemd kills the gateway after 60 s."""
FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""Errors of a disk without room."""
ROOM: Final = "room on the disk"
PIPE_SIZE: Final = 1 << 20
"""[bytes] About 10 s of records at 100 Hz: the disk may be busy so long before one is dropped."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """Task of the recorder's process: file, header, and what is kept."""

    path: Path
    header: Header
    keeping: Keeping = field(default_factory=Keeping)


class Recorder:
    """The loop's end of the pipe.

    dropped : count of lost records; failed : the recorder's process has ended early
    """

    def __init__(self, job: Job) -> None:
        _create(job)
        context = multiprocessing.get_context("spawn")
        receiver, self._sender = context.Pipe(duplex=False)
        with suppress(OSError):
            fcntl.fcntl(self._sender.fileno(), fcntl.F_SETPIPE_SZ, PIPE_SIZE)
        os.set_blocking(self._sender.fileno(), False)
        self._process = context.Process(target=record, args=(receiver, job), name="recorder")
        with _block_signals():
            self._process.start()
        receiver.close()
        self.path = job.path
        self.dropped = 0
        self.failed = False

    def push(self, record: bytes) -> None:
        """Hand over one record without waiting."""
        try:
            os.write(self._sender.fileno(), record)
        except BlockingIOError:
            self.dropped += 1
        except BrokenPipeError:
            self.failed = True

    def close(self) -> None:
        """End the recording, and return when it is on the disk.

        Raises GatewayError where the recorder failed, or does not come to its end.
        """
        self._sender.close()
        self._process.join(PATIENCE)
        if self._process.exitcode is None:
            self._process.kill()  # a process that waits for its disk dies when the disk answers
            raise GatewayError(
                f"{self.path}: the recorder has not ended in {PATIENCE:g} s; "
                "expected a disk that takes what is written"
            )
        if code := self._process.exitcode:
            raise GatewayError(f"{self.path}: the recorder failed: {reason_of_end(code)}")


def reason_of_end(code: int) -> str:
    """Why the recorder's process ended with this exit code.

    A negative code is a signal, 1 is a mistake in this software, any other code a failed write.
    """
    if code < 0:
        return f"killed by {signal.Signals(-code).name}"
    if code == 1:
        return "exit code 1, a mistake in this software"
    return f"{os.strerror(code)}; expected {ROOM if code in FULL else 'a file to write to'}"


@contextmanager
def _block_signals() -> Iterator[None]:
    """Block signals while a process starts, so that a Ctrl-C does not end it at once."""
    before = signal.pthread_sigmask(
        signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    )
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def record(receiver: Connection, job: Job) -> None:
    """Run the recorder's process: append every record until the loop closes its end."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    try:
        _append(receiver, job)
    except OSError as error:
        # The broken pipe makes the loop ramp down; `close` turns the number into words.
        sys.exit(error.errno)


def _append(receiver: Connection, job: Job) -> None:
    head, layout = job.header.encode(), job.header.layout
    wait, kind = Wait(layout.formats), np.dtype(layout.formats)
    with (
        closing(Parts(job.path, head, job.keeping)) as parts,
        closing(Trips(job.path, head, layout.formats)) as trips,
    ):
        for batch in _batches(receiver.fileno(), layout.size):
            if batch:
                last = float(np.frombuffer(batch, kind)["now"][-1])
                parts.write(wait.filter(batch), last)
                trips.take(batch)
        parts.write(wait.flush(), 0.0)
    if trips.problem is not None:
        raise trips.problem


def _batches(source: int, size: int) -> Iterator[bytes]:
    """Whole records from the pipe, a few at a time."""
    waiting = b""
    while chunk := os.read(source, PIPE_SIZE):
        waiting += chunk
        whole = len(waiting) // size * size
        yield waiting[:whole]
        waiting = waiting[whole:]
        time.sleep(BATCH)


def _create(job: Job) -> None:
    """Create the file before anything runs. Raises RecordingError for a bad folder.

    Raises GatewayError for a full disk, which is no bad input: systemd tries again.
    """
    try:
        job.path.parent.mkdir(parents=True, exist_ok=True)
        with job.path.open("xb") as file:
            file.write(job.header.encode())
    except OSError as error:
        if error.errno in FULL:
            job.path.unlink(missing_ok=True)
            raise GatewayError(f"{job.path}: {error.strerror}; expected {ROOM}") from error
        raise RecordingError(
            error.strerror or "cannot be created",
            file=job.path,
            expected="[recording] dir that can be written",
        ) from error
