"""Recordings: a header, and one record a tick.

File = head (gateway.recordings.header), records (gateway.cycle.record). The header has
configuration and register map with their hashes, so that a recording can be replayed without their
files.

A recording is only appended to. A crash leaves a file whose last record may be cut; that record is
left out with a note. Any other record with a wrong checksum is damage, and a damaged recording is
refused.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np

from gateway.cycle.record import MAGIC, is_intact
from gateway.cycle.supervisor import State
from gateway.errors import RecordingError
from gateway.recordings.header import PREFIX, Header, decode, length_of
from gateway.recordings.parts import SUFFIX, find_later_parts, open_plain_or_compressed, plain_size

CHUNK: Final = 1000
PIECE: Final = 5000
"""Records that a stream reads at once: some megabytes."""
TAIL: Final = 1 << 16
"""[bytes] Piece in which zeros at the end of a file are sought."""


class DamageError(RecordingError):
    """A recording with a damaged record; exit code 1."""

    exit_code = 1


@dataclass(frozen=True, kw_only=True)
class GatewayRecording:
    """A recording in memory.

    records : structured NumPy array, fields as gateway.cycle.record.Layout.formats
    note : bytes that were left out at the end; empty: none
    """

    path: Path
    header: Header
    records: "np.ndarray[Any, np.dtype[np.void]]"
    note: str

    def __len__(self) -> int:
        return len(self.records)

    def rows(self) -> Iterator[dict[str, Any]]:
        """The ticks one by one, as plain numbers and lists."""
        names = self.records.dtype.names or ()
        for first in range(0, len(self.records), CHUNK):
            for row in self.records[first : first + CHUNK].tolist():
                yield dict(zip(names, row, strict=True))

    def state(self, code: int) -> str:
        """Name of a state."""
        return self.header.state(code)

    def reason(self, code: int) -> str:
        """Name of a reason or fault; empty: none."""
        return self.header.reason(code)

    def stop_reason(self) -> str:
        """Name of the reason for which the gateway first left RUN; empty: it did not."""
        after = self.records[self.records["state"] == State.RAMPDOWN]
        return self.reason(int(after["reason"][0])) if len(after) else ""


def read(path: Path) -> GatewayRecording:
    """Recording in a file; the file of its first part stands for the whole run.

    Raises RecordingError, and DamageError for a damaged record.
    """
    first, *others = [_read_part(one) for one in (path, *find_later_parts(path))]
    if not others:
        return first
    return replace(
        first,
        records=np.concatenate([first.records, *(one.records for one in others)]),
        note="; ".join(one.note for one in (first, *others) if one.note),
    )


def _read_part(path: Path) -> GatewayRecording:
    try:
        with open_plain_or_compressed(path) as file:
            content = file.read()
    except (OSError, EOFError) as error:
        raise _unreadable(path, error) from error
    header, start = decode(path, content)
    layout, body = header.layout, content[start:]
    whole = _count_finished(body, layout.size)
    left = len(body) - whole * layout.size
    records = np.frombuffer(body, dtype=np.dtype(layout.formats), count=whole)
    _check(path, body, records)
    note = f"{path}: {left} bytes of an unfinished last record left out" if left else ""
    return GatewayRecording(path=path, header=header, records=records, note=note)


@dataclass(frozen=True, kw_only=True)
class Stream:
    """A recording that is read piece by piece; every reading begins at its first record.

    parts : the streams of the parts that follow in the same run
    """

    path: Path
    header: Header
    start: int
    note: str
    count: int
    parts: "tuple[Stream, ...]" = ()

    def __len__(self) -> int:
        return self.count + sum(map(len, self.parts))

    def chunks(self) -> "Iterator[np.ndarray[Any, np.dtype[np.void]]]":
        """The records, some at a time. Raises DamageError for a damaged one."""
        yield from self._chunks()
        for part in self.parts:
            yield from part.chunks()

    def _chunks(self) -> "Iterator[np.ndarray[Any, np.dtype[np.void]]]":
        layout, tick = self.header.layout, 0
        with open_plain_or_compressed(self.path) as file:
            file.seek(self.start)
            for first in range(0, self.count, PIECE):
                body = file.read(min(PIECE, self.count - first) * layout.size)
                records = np.frombuffer(body, dtype=np.dtype(layout.formats))
                _check(self.path, body, records, tick)
                tick = int(records["tick"][-1]) + 1
                yield records


def stream(path: Path) -> Stream:
    """The recording in a file, without its records; the first part stands for the whole run.

    Raises RecordingError.
    """
    first, *others = [_stream_part(one) for one in (path, *find_later_parts(path))]
    note = "; ".join(one.note for one in (first, *others) if one.note)
    return replace(first, parts=tuple(others), note=note)


def _stream_part(path: Path) -> Stream:
    try:
        with open_plain_or_compressed(path) as file:
            head = file.read(PREFIX)
            header, start = decode(path, head + file.read(length_of(head)))
            end, size = plain_size(path), header.layout.size
            whole = _whole_records(file, start, end, size)
    except OSError as error:
        raise _unreadable(path, error) from error
    left = end - start - whole * size
    note = f"{path}: {left} bytes of an unfinished last record left out" if left else ""
    return Stream(path=path, header=header, start=start, note=note, count=whole)


def _whole_records(file: BinaryIO, start: int, end: int, size: int) -> int:
    """Count of the records before one that a crash left unfinished; see `_count_finished`."""
    last = end
    while last > start:
        begin = max(start, last - TAIL)
        file.seek(begin)
        kept = file.read(last - begin).rstrip(b"\0")
        if kept:
            last = begin + len(kept)
            break
        last = begin
    count = -(-(last - start) // size)
    file.seek(start + max(0, count - 1) * size)
    return max(0, count - 1) + _count_finished(file.read(size), size)


def _unreadable(path: Path, error: OSError | EOFError) -> RecordingError:
    return RecordingError(
        getattr(error, "strerror", None) or "cannot be read",
        file=path,
        expected=f"a recording ({SUFFIX})",
    )


def _count_finished(body: bytes, size: int) -> int:
    """Count of the records before one that a crash left unfinished.

    Zeros may follow it, because a file system extends a file before it writes the content.
    """
    last = -(-len(body.rstrip(b"\0")) // size)
    torn = last > 0 and not is_intact(body[(last - 1) * size : last * size])
    return last - torn


def _check(
    path: Path, body: bytes, records: "np.ndarray[Any, np.dtype[np.void]]", first: int = 0
) -> None:
    """Refuse damaged records. The record before a damaged one gives its tick.

    first : tick of the first record
    """
    size = records.itemsize
    places = range(0, len(records) * size, size)
    bad = [k for k, at in enumerate(places) if not is_intact(body[at : at + size])]
    if bad:
        tick = int(records[bad[0] - 1]["tick"]) + 1 if bad[0] else first
        raise DamageError(
            f"checksum differs, {len(bad)} of {len(records)} records damaged",
            file=path,
            place=f"tick {tick}",
            expected="every record as the gateway wrote it",
        )


def is_recording(path: Path) -> bool:
    """Whether the file begins like a recording. Raises RecordingError if it cannot be read."""
    try:
        with open_plain_or_compressed(path) as file:
            return bool(file.read(len(MAGIC)) == MAGIC)
    except (OSError, EOFError) as error:
        raise RecordingError(
            getattr(error, "strerror", None) or "cannot be read",
            file=path,
            expected="a log or a recording",
        ) from error
