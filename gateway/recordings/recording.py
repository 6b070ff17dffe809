"""Recordings: a header that says under what they were made, and one record a tick. Read and append.

File = magic, length of the header (4 bytes, little-endian), header (JSON), records
(gateway.cycle.record). The header carries the texts of configuration and register map with their
hashes, so that a recording can be replayed without the files it was made with. Only appended to:
what a crash leaves is a file whose last record may be cut, and such a record is left out with a
note. Any other record whose checksum differs is damage, and what holds damage is not used.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.cycle.record import MAGIC, NOTHING, Layout, is_intact
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError

SUFFIX: Final = ".rlrec"
SCHEMA: Final = "recording/1"
CHUNK: Final = 1000


class RecordingError(ConfigError):
    """A file that is no recording, or cannot become one."""


class DamageError(RecordingError):
    """A recording of which a record is not what the gateway wrote."""

    exit_code = 1


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A recording in memory.

    records : numpy structured array, fields as gateway.cycle.record.Layout.formats
    note : what had to be left out at the end, or empty
    """

    path: Path
    header: dict[str, Any]
    layout: Layout
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
        return str(self.header["states"][str(code)])

    def reason(self, code: int) -> str:
        """Name of a reason or fault; empty: there is none."""
        return str(self.header["reasons"][str(code)][0]) if code != NOTHING else ""

    def stop_reason(self) -> str:
        """Name of the reason why the gateway left RUN first; empty: it did not."""
        after = self.records[self.records["state"] == State.RAMPDOWN]
        return self.reason(int(after["reason"][0])) if len(after) else ""


def encode_header(header: dict[str, Any]) -> bytes:
    """First bytes of a recording."""
    text = json.dumps({"schema": SCHEMA, **header}).encode()
    return MAGIC + len(text).to_bytes(4, "little") + text


def read(path: Path) -> Recording:
    """The recording in a file."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RecordingError(
            error.strerror or "cannot be read", file=path, expected=f"a recording ({SUFFIX})"
        ) from error
    header, start = _header(path, content)
    layout = Layout(read_count=header["read_count"], write_count=header["write_count"])
    body = content[start:]
    whole = _finished(body, layout.size)
    left = len(body) - whole * layout.size
    records = np.frombuffer(body, dtype=np.dtype(layout.formats), count=whole)
    _check(path, body, records)
    note = f"{path}: {left} bytes of an unfinished last record left out" if left else ""
    return Recording(path=path, header=header, layout=layout, records=records, note=note)


def _finished(body: bytes, size: int) -> int:
    """Number of records before the one that a crash left unfinished.

    After it may stand zeros: a file system gives a file its length before its content.
    """
    last = -(-len(body.rstrip(b"\0")) // size)
    torn = last > 0 and not is_intact(body[(last - 1) * size : last * size])
    return last - torn


def _check(path: Path, body: bytes, records: "np.ndarray[Any, np.dtype[np.void]]") -> None:
    """Refuse records that are not what was written; the record before tells a bad one's tick."""
    size = records.itemsize
    places = range(0, len(records) * size, size)
    bad = [k for k, at in enumerate(places) if not is_intact(body[at : at + size])]
    if bad:
        tick = int(records[bad[0] - 1]["tick"]) + 1 if bad[0] else 0
        raise DamageError(
            f"checksum differs, {len(bad)} of {len(records)} records damaged",
            file=path,
            place=f"tick {tick}",
            expected="every record as the gateway wrote it",
        )


def is_recording(path: Path) -> bool:
    """Whether a file begins as a recording does."""
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def _header(path: Path, content: bytes) -> tuple[dict[str, Any], int]:
    start = len(MAGIC) + 4
    length = int.from_bytes(content[len(MAGIC) : start], "little")
    if not content.startswith(MAGIC) or len(content) < start + length:
        raise RecordingError(
            "is no recording",
            file=path,
            value=content[: len(MAGIC)],
            expected=f"a file that begins with {MAGIC!r} and a whole header",
        )
    try:
        header = json.loads(content[start : start + length])
    except ValueError as error:
        raise RecordingError(str(error), file=path, place="header", expected="JSON") from error
    if header.get("schema") != SCHEMA:
        raise RecordingError(
            "unknown form",
            file=path,
            place="schema",
            value=header.get("schema"),
            expected=repr(SCHEMA),
        )
    return header, start + length
