"""Reads and writes CSV logs; `register_maps.logs.csv_log` defines the format."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING

from plant_emulator.logs import _files
from register_maps.logs.csv_log import GZIP, parse

if TYPE_CHECKING:
    from pathlib import Path

    from plant_emulator.signals.log import Log

NAME = "CSV"
SUFFIXES = (".csv", ".csv.gz")
BINARY = frozenset(range(32)) - frozenset(b"\t\r\n\f")


def recognises(head: bytes) -> bool:
    """Whether a file that begins with these bytes is a CSV log: gzip, or text with a comma."""
    if head.startswith(GZIP):
        return True
    line = head.split(b"\n", 1)[0]
    return b"," in line and BINARY.isdisjoint(line)


def read(path: Path) -> Log:
    """Read the log of a CSV file, SI; LogError names file, line and column."""
    return _files.read(path, parse)


def text(log: Log) -> str:
    """Text of a CSV file with the signals of a log, their units in the names of the columns."""
    columns, values = zip(*_files.in_units(log), strict=True)
    lines = [",".join(column.column for column in columns)]
    formats = [f"{{:.{column.decimals}f}}".format for column in columns]
    lines += [
        # + 0.0 turns a negative zero into a zero
        ",".join(form(value + 0.0) for form, value in zip(formats, row, strict=True))
        for row in zip(*values, strict=True)
    ]
    return "\n".join(lines) + "\n"


def write(log: Log, path: Path) -> None:
    """Write a log as CSV, compressed if the file's name ends in .gz."""
    data = text(log).encode()
    path.write_bytes(gzip.compress(data, mtime=0) if path.name.endswith(".gz") else data)
