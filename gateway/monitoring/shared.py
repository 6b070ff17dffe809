"""The status block in shared memory: made by the daemon, found and read by other processes.

The file holds a page with the identity of the daemon (JSON), and the block behind it. The daemon
locks its file for as long as it lives, so that a file without a lock was left behind by a crash.
Memory (/dev/shm) holds the file; no disk is touched. $RUNTIME_DIRECTORY names another folder.
"""

import fcntl
import json
import mmap
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from gateway.cycle.record import Tick
from gateway.errors import GatewayError
from gateway.monitoring import block
from gateway.monitoring.block import Block, Snapshot

MAGIC: Final = b"RLSTAT\x02\n"
"""The last number changes with the layout of the block."""
IDENTITY: Final = 16384
"""[bytes] Room for magic and identity."""
NAME: Final = "gateway-{}.status"
PATIENCE: Final = 0.5
"""[s] Time for which a reader tries to find the block at rest; the writer takes microseconds."""
RETRY: Final = 5e-4


class NotRunningError(GatewayError):
    """No gateway shows its status; exit code 1."""


@dataclass(frozen=True, kw_only=True)
class Identity:
    """Facts about one run of the daemon; the fields are the keys of their JSON.

    title, date : of the recording, the date in ISO 8601, UTC; period : between two ticks [s]
    version : of the gateway; recording : its path; real_time : what the system granted
    planned : time that the program takes [s]; None: a run without a program
    """

    pid: int
    title: str
    date: str
    period: float
    version: str
    recording: str
    real_time: str
    planned: float | None


def folder() -> Path:
    """Folder of the status files."""
    return Path(os.environ.get("RUNTIME_DIRECTORY", "/dev/shm"))


class Publisher:
    """The daemon's side: owns the file, as a context manager, and takes every tick."""

    def __init__(self, identity: Identity) -> None:
        for path, _ in _files(alive=False):
            with suppress(OSError):  # it may belong to another user
                path.unlink()
        self.path = folder() / NAME.format(os.getpid())
        self._file = _create(self.path, identity)
        self._memory = mmap.mmap(self._file, IDENTITY + block.SIZE)
        self._block = Block(memoryview(self._memory)[IDENTITY:])

    def __call__(self, tick: Tick) -> None:
        """Show one tick."""
        self._block.update(tick)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.path.unlink(missing_ok=True)
        os.close(self._file)


class Observer:
    """A reader of the status of one daemon. Raises NotRunningError for a file of another kind."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with path.open("rb") as file:
            self._memory = mmap.mmap(file.fileno(), IDENTITY + block.SIZE, prot=mmap.PROT_READ)
        self._view = memoryview(self._memory)[IDENTITY:]
        identity = _identity(self._memory[:IDENTITY])
        if identity is None:
            raise NotRunningError(f"{path}: not the status of a gateway of this version")
        self.identity = identity

    def is_alive(self) -> bool:
        """Whether the daemon still runs."""
        with suppress(OSError), self._path.open("rb") as file:
            return _is_locked(file.fileno())
        return False

    def snapshot(self) -> Snapshot:
        """The newest whole block. Raises NotRunningError where the writer died in a write."""
        deadline = time.monotonic() + PATIENCE
        while (content := block.copy(self._view)) is None:
            if time.monotonic() > deadline:
                raise NotRunningError("the gateway ended while it wrote its status")
            time.sleep(RETRY)
        return block.decode(content)


def find(pid: int | None = None) -> Path:
    """Status file of the running gateway. Raises NotRunningError for none, or for several."""
    running = {path: identity for path, identity in _files(alive=True) if identity is not None}
    if pid is not None:
        running = {path: one for path, one in running.items() if one.pid == pid}
    if not running:
        whom = "no gateway" if pid is None else f"no gateway of process {pid}"
        raise NotRunningError(
            f"{folder()}: {whom} runs here; expected one that `gateway run` has started"
        )
    if len(running) > 1:
        several = "; ".join(f"--pid {one.pid}: {one.title}" for one in running.values())
        raise NotRunningError(f"several gateways run here; expected one of {several}")
    return next(iter(running))


def _create(path: Path, identity: Identity) -> int:
    """A new locked file with identity and empty block; its descriptor. Raises GatewayError."""
    content = MAGIC + json.dumps(vars(identity), ensure_ascii=False).encode()
    try:
        path.unlink(missing_ok=True)
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o644)
        fcntl.flock(file, fcntl.LOCK_EX)
        os.write(file, content[:IDENTITY].ljust(IDENTITY + block.SIZE, b"\0"))
    except OSError as error:
        raise GatewayError(
            f"{path}: {error.strerror}; expected a folder for the status, see RUNTIME_DIRECTORY"
        ) from error
    return file


def _files(*, alive: bool) -> Iterator[tuple[Path, Identity | None]]:
    """Status files of daemons that live or died, each with its identity (None: not readable)."""
    for path in sorted(folder().glob(NAME.format("*"))):
        with suppress(OSError), path.open("rb") as file:
            if _is_locked(file.fileno()) is alive:
                yield path, _identity(file.read(IDENTITY))


def _is_locked(file: int) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    return False


def _identity(page: bytes) -> Identity | None:
    if not page.startswith(MAGIC):
        return None
    # The file may be that of somebody else, or of one who died while writing it.
    with suppress(ValueError, TypeError):
        return Identity(**json.loads(page[len(MAGIC) :].rstrip(b"\0")))
    return None
