"""The files of one run: its parts one after another, compressed when closed, old files removed.

A part ends at a size or after a time. Old files are removed then, and at the start of a run. The
first part is NAME.rlrec, the next ones are NAME.002.rlrec and so on; each has the whole header. A
closed part becomes NAME.rlrec.gz in a thread of the recorder, whose pipe meanwhile takes the
records. The last part stays as it is.
"""

import gzip
import os
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any, Final

SUFFIX: Final = ".rlrec"
COMPRESSED: Final = ".gz"
TRIPS: Final = "trips"
"""Folder of the files of trips, beside the recordings."""
SYNC: Final = 1.0
"""[s] Period of synchronising the file with the disk."""
LEVEL: Final = 6
"""Level of gzip: 175 MB, an hour at 100 Hz with noisy sensors, become 63 MB in 4 s."""


@dataclass(frozen=True, kw_only=True)
class Keeping:
    """When a part ends, and what is kept.

    size [bytes], time [s] : at which a part ends
    age [s], total [bytes] : above which old recordings are removed; None: never
    """

    size: float = 256e6
    time: float = 3600.0
    age: float | None = None
    total: float | None = None


class Parts:
    """Writes the records of one run; now : monotonic time of a batch [s]."""

    def __init__(self, path: Path, head: bytes, keeping: Keeping) -> None:
        self._first, self._head, self._keeping = path, head, keeping
        self._number, self._began = 1, -1.0
        self._synced = time.monotonic()
        self._file = path.open("ab", buffering=0)
        self._tidier = threading.Thread(target=self._tidy, args=(path,))
        self._tidier.start()

    def write(self, batch: bytes, now: float) -> None:
        """Append whole records; now : time of the last one [s]."""
        if not batch:
            return
        self._began = now if self._began < 0.0 else self._began
        if self._is_full(now):
            self._rotate(now)
        write_all(self._file, batch)
        if time.monotonic() - self._synced > SYNC:
            os.fdatasync(self._file.fileno())
            self._synced = time.monotonic()

    def close(self) -> None:
        """Close the last part, when all is on the disk."""
        os.fsync(self._file.fileno())
        self._file.close()
        self._tidier.join()

    def _is_full(self, now: float) -> bool:
        return self._file.tell() >= self._keeping.size or now - self._began >= self._keeping.time

    def _rotate(self, now: float) -> None:
        closed = part_path(self._first, self._number)
        self._number, self._began = self._number + 1, now
        following = part_path(self._first, self._number)
        os.fsync(self._file.fileno())
        self._file.close()
        self._file = following.open("xb", buffering=0)
        write_all(self._file, self._head)
        self._tidier.join()
        self._tidier = threading.Thread(target=self._tidy, args=(following, closed))
        self._tidier.start()

    def _tidy(self, current: Path, closed: Path | None = None) -> None:
        """Compress a closed part, and remove what is not to be kept beside the current one."""
        with suppress(OSError):  # a full disk: the closed part stays as it is
            if closed is not None:
                compress(closed)
            remove_old(current.parent, self._keeping, spared=current)


def write_all(file: FileIO, batch: bytes) -> None:
    """Write the whole batch; a disk that fills up takes a part first, without an error."""
    left = memoryview(batch)
    while left:
        left = left[file.write(left) :]


def part_path(first: Path, number: int) -> Path:
    """Path of a part before it is compressed; number : from 1."""
    if number == 1:
        return first
    return first.with_name(f"{first.name.removesuffix(SUFFIX)}.{number:03d}{SUFFIX}")


def find_later_parts(first: Path) -> Iterator[Path]:
    """Parts that follow the first part of a run, compressed or not."""
    plain = first.with_name(first.name.removesuffix(COMPRESSED))
    number = 2
    while (found := _find_existing(part_path(plain, number))) is not None:
        yield found
        number += 1


def _find_existing(path: Path) -> Path | None:
    packed = path.with_name(path.name + COMPRESSED)
    return next((one for one in (path, packed) if one.exists()), None)


def compress(path: Path) -> None:
    """Replace a file by its compressed form; a crash leaves the one or the other whole."""
    packed = path.with_name(path.name + COMPRESSED)
    half = packed.with_name(packed.name + ".part")
    with path.open("rb") as source, gzip.open(half, "wb", compresslevel=LEVEL) as target:
        shutil.copyfileobj(source, target, 1 << 20)
    with half.open("rb") as file:
        os.fsync(file.fileno())
    half.rename(packed)
    path.unlink()


def remove_old(folder: Path, keeping: Keeping, *, spared: Path) -> None:
    """Remove recordings that are too old, then the oldest ones over the total size.

    spared : a file that stays. Files of trips are removed by age only.
    """
    if keeping.age is not None:
        oldest = time.time() - keeping.age
        for path in (*_recordings(folder), *_recordings(folder / TRIPS)):
            if path != spared and path.stat().st_mtime < oldest:
                path.unlink()
    if keeping.total is not None:
        left = sorted(_recordings(folder), key=lambda path: path.stat().st_mtime)
        over = sum(path.stat().st_size for path in left) - keeping.total
        for path in left:
            if over > 0.0 and path != spared:
                over -= path.stat().st_size
                path.unlink()


def _recordings(folder: Path) -> list[Path]:
    return [*folder.glob(f"*{SUFFIX}"), *folder.glob(f"*{SUFFIX}{COMPRESSED}")]


def open_plain_or_compressed(path: Path) -> Any:
    """A file for reading, whose content is the plain one."""
    file = path.open("rb")
    if file.read(2) == b"\x1f\x8b":
        file.close()
        return gzip.open(path, "rb")
    file.seek(0)
    return file


def plain_size(path: Path) -> int:
    """Size of the plain content [bytes], for a compressed part that is shorter than 4 GB."""
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
        size = file.seek(0, os.SEEK_END)
        if not packed:
            return size
        file.seek(-4, os.SEEK_END)
        return int.from_bytes(file.read(4), "little")
