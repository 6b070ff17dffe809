"""Recordings: a header that says under what they were made, and one record a tick. Read and append.

File = magic, length of the header (4 bytes, little-endian), header (JSON), records
(gateway.record). The header carries the texts of configuration and register map with their hashes,
so that a recording can be replayed without the files it was made with. Only appended to: what a
crash leaves is a file whose last record may be cut, and such a record is left out with a note.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.errors import ConfigError
from gateway.record import MAGIC, NOTHING, Layout, intact

SUFFIX: Final = ".rlrec"
SCHEMA: Final = "recording/1"
CHUNK: Final = 1000


class RecordingError(ConfigError):
    """A file that is no recording, or cannot become one."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A recording in memory.

    records : numpy structured array, fields as gateway.record.Layout.formats
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
    body = memoryview(content)[start:]
    whole = len(body) // layout.size
    while whole and not intact(bytes(body[(whole - 1) * layout.size : whole * layout.size])):
        whole -= 1
    left = len(body) - whole * layout.size
    records = np.frombuffer(body[: whole * layout.size], dtype=np.dtype(layout.formats))
    note = f"{path}: {left} bytes of an unfinished last record left out" if left else ""
    return Recording(path=path, header=header, layout=layout, records=records, note=note)


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
