"""What of the ticks is written: no long wait for the PLC, and a file of its own for every trip."""

from collections import deque
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.cycle.record import READ
from gateway.cycle.supervisor import State
from gateway.reasons import BY_OPERATOR
from gateway.recordings.parts import SUFFIX, TRIPS, write_all

WAIT: Final = 3.0
"""[s] Stretch at the beginning and at the end of a wait for the PLC that is written."""
BEFORE: Final = 10.0
AFTER: Final = 5.0
"""[s] Stretch of the file of a trip before and after it."""
Fields = list[tuple[str, str, tuple[int, ...]]]


class Held:
    """Records of the last seconds. Time is that of the records."""

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._records: deque[tuple[float, bytes]] = deque()

    def add(self, now: float, record: bytes) -> None:
        """Hold a record, and forget those that are too old by now [s]."""
        self._records.append((now, record))
        while now - self._records[0][0] > self._duration:
            self._records.popleft()

    def release(self) -> bytes:
        """The held records, which are no longer held."""
        records = b"".join(record for _, record in self._records)
        self._records.clear()
        return records


class Wait:
    """Lets records through, except the middle of a long wait for the PLC.

    A wait is a stretch of CONNECT without an image. Its ticks are alike: a replay comes out the
    same without them.
    """

    def __init__(self, fields: Fields) -> None:
        self._type = np.dtype(fields)
        self._held = Held(WAIT)
        self._since: float | None = None

    def filter(self, batch: bytes) -> bytes:
        """The records of a batch that are to be written, and held ones before them."""
        written, size = [], self._type.itemsize
        for index, tick in enumerate(np.frombuffer(batch, self._type)):
            record, now = batch[index * size : (index + 1) * size], float(tick["now"])
            waits = tick["state"] == State.CONNECT and not tick["flags"] & READ
            self._since = (now if self._since is None else self._since) if waits else None
            if self._since is not None and now - self._since > WAIT:
                self._held.add(now, record)
            else:
                written += [self._held.release(), record]
        return b"".join(written)

    def flush(self) -> bytes:
        """Records that are still held."""
        return self._held.release()


class Trips:
    """Writes the seconds around every trip to a file of its own.

    problem : the first error of such a file. It ends no recording, which has these seconds, too.
    """

    def __init__(self, path: Path, head: bytes, fields: Fields) -> None:
        self._path, self._head, self._type = path, head, np.dtype(fields)
        self._held = Held(BEFORE)
        self._count, self._state = 0, int(State.OFF)
        self._file: Any = None
        self._until = 0.0
        self.problem: OSError | None = None

    def take(self, batch: bytes) -> None:
        """Take a batch of whole records."""
        if self.problem is not None:
            return
        try:
            self._take(batch)
        except OSError as error:
            self.problem = error
            self.close()

    def _take(self, batch: bytes) -> None:
        size = self._type.itemsize
        for index, tick in enumerate(np.frombuffer(batch, self._type)):
            record, now = batch[index * size : (index + 1) * size], float(tick["now"])
            if self._file is None and self._trips(tick):
                self._begin(now)
            self._state = int(tick["state"])
            if self._file is None:
                self._held.add(now, record)
                continue
            write_all(self._file, record)
            if now >= self._until:
                self.close()

    def close(self) -> None:
        """End the file of a trip."""
        if self._file is not None:
            self._file.close()
        self._file = None

    def _trips(self, tick: np.void) -> bool:
        return (
            self._state == State.RUN
            and tick["state"] == State.RAMPDOWN
            and tick["reason"] not in BY_OPERATOR
        )

    def _begin(self, now: float) -> None:
        self._count, self._until = self._count + 1, now + AFTER
        folder = self._path.parent / TRIPS
        folder.mkdir(exist_ok=True)
        name = f"{self._path.name.removesuffix(SUFFIX)}.{self._count:03d}{SUFFIX}"
        self._file = (folder / name).open("xb", buffering=0)
        write_all(self._file, self._head + self._held.release())
