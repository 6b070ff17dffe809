"""CSV logs on disk; what one may hold is told in `register_maps.csv_log`."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.log import Log
from register_maps.csv_log import GZIP, CsvLogError, parse
from register_maps.signals import LOG_COLUMNS
from register_maps.units import UNITS

if TYPE_CHECKING:
    from pathlib import Path

NAME = "CSV"
SUFFIXES = (".csv", ".csv.gz")


def recognises(head: bytes) -> bool:
    """Whether a file that begins with these bytes is a CSV log: gzip, or text with a comma."""
    if head.startswith(GZIP):
        return True
    line = head.split(b"\n", 1)[0]
    return b"," in line and b"\0" not in line


def read(path: Path) -> Log:
    """The log of a CSV file; LogError names file, line and column."""
    try:
        found = parse(path.read_bytes())
    except CsvLogError as error:
        raise LogError(f"{path}: {error}") from error
    signals = {signal: np.array(values) for signal, values in found.signals.items()}
    return Log(signals.pop("time"), signals, str(path), found.other)


def text(log: Log) -> str:
    """The signals of a log with their units in the column names, as the text of a CSV file."""
    all_signals = {"time": log.time, **log.signals}
    columns = [column for column in LOG_COLUMNS.values() if column.signal in all_signals]
    values = [
        (all_signals[column.signal] - UNITS[column.unit].shift) / UNITS[column.unit].factor
        for column in columns
    ]
    lines = [",".join(column.column for column in columns)]
    formats = [f"{{:.{column.decimals}f}}".format for column in columns]
    lines += [
        # + 0.0 turns a negative zero into a zero
        ",".join(form(value + 0.0) for form, value in zip(formats, row, strict=True))
        for row in zip(*values, strict=True)
    ]
    return "\n".join(lines) + "\n"


def write(log: Log, path: Path) -> None:
    """Write a log; a name that ends in .gz is compressed."""
    data = text(log).encode()
    path.write_bytes(gzip.compress(data, mtime=0) if path.name.endswith(".gz") else data)
