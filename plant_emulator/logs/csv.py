"""CSV logs (contracts, section 1): UTF-8, comma, one header line, plain or gzip-compressed."""

from __future__ import annotations

import gzip
import zlib
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.log import COLUMNS, Array, Log, checked

if TYPE_CHECKING:
    from pathlib import Path

NAME = "CSV"
SUFFIXES = (".csv", ".csv.gz")
GZIP = b"\x1f\x8b"
BY_NAME = {column.name: column for column in COLUMNS}


def recognises(head: bytes) -> bool:
    """Whether a file that begins with these bytes is a CSV log: gzip, or text with a comma."""
    if head.startswith(GZIP):
        return True
    line = head.split(b"\n", 1)[0]
    return b"," in line and b"\0" not in line


def read(path: Path) -> Log:
    """The log of a CSV file; LogError names file, line and column."""
    text = _text(path)
    header, _, body = text.partition("\n")
    names = [name.strip() for name in header.strip().lstrip("\ufeff").split(",")]
    _check_header(path, names)
    lines = [line for line in body.splitlines() if line.strip()]
    if not lines:
        raise LogError(f"{path}: line 2: no sample; at least 2 are needed")
    known = [name for name in names if name in BY_NAME]
    table = _table(lines, names, known)
    if table is None or not _sound(table, known):
        raise _first_fault(path, names, body)
    columns = dict(zip(known, table.T, strict=True))
    signals = {BY_NAME[name].signal: v + BY_NAME[name].offset for name, v in columns.items()}
    time = signals.pop("time")
    other = tuple(name for name in names if name not in BY_NAME)
    return checked(Log(time, signals, str(path), other))


def _table(lines: list[str], names: list[str], known: list[str]) -> Array | None:
    """The known columns, shape (n, columns); None where a row does not fit. Others may be text."""
    if any(line.count(",") != len(names) - 1 for line in lines):
        return None
    columns = [names.index(name) for name in known]
    try:
        return np.loadtxt(lines, delimiter=",", ndmin=2, usecols=columns, comments=None)
    except ValueError:
        return None


def text(log: Log) -> str:
    """The signals of a log with their units in the column names, as the text of a CSV file."""
    all_signals = {"time": log.time, **log.signals}
    columns = [column for column in COLUMNS if column.signal in all_signals]
    values = [all_signals[column.signal] - column.offset for column in columns]
    lines = [",".join(column.name for column in columns)]
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


def _text(path: Path) -> str:
    data = path.read_bytes()
    try:
        if data.startswith(GZIP):
            data = gzip.decompress(data)
        return data.decode("utf-8")
    except (OSError, EOFError, zlib.error) as error:
        raise LogError(f"{path}: damaged gzip file ({error})") from error
    except UnicodeDecodeError as error:
        raise LogError(f"{path}: byte {error.start}: not UTF-8 text") from error


def _check_header(path: Path, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise LogError(f"{path}: line 1: column {name} stands twice")
        for column in COLUMNS:
            if column.name not in names and name.startswith(column.signal + "_"):
                raise LogError(f"{path}: line 1: column {name}; expected {column.name}")
    for column in COLUMNS:
        if column.needed and column.name not in names:
            raise LogError(f"{path}: line 1: column {column.name} is missing; it is needed")


def _sound(table: Array, known: list[str]) -> bool:
    time = table[:, known.index("time_s")]
    return bool(np.isfinite(table).all() and (np.diff(time) > 0).all())


def _first_fault(path: Path, names: list[str], body: str) -> LogError:
    """The first fault of the text, with line and column; found cell by cell."""
    last = -np.inf
    for number, line in enumerate(body.splitlines(), start=2):
        if not line.strip():
            continue
        cells = line.split(",")
        if len(cells) != len(names):
            return LogError(
                f"{path}: line {number}: {len(cells)} values; {len(names)} columns are expected"
            )
        row = {name: cell for name, cell in zip(names, cells, strict=True) if name in BY_NAME}
        for name, cell in row.items():
            if expected := _lacking(cell):
                return LogError(
                    f"{path}: line {number}, column {name}: {cell!r}; expected {expected}"
                )
        time = float(row["time_s"])
        if time <= last:
            return LogError(
                f"{path}: line {number}, column time_s: {row['time_s']} after {last:g}; "
                "time must increase strictly"
            )
        last = time
    return LogError(f"{path}: not a table of numbers")


def _lacking(cell: str) -> str:
    """What a cell should have been; nothing where it is a finite number."""
    try:
        return "" if np.isfinite(float(cell)) else "a finite number"
    except ValueError:
        return "a number"
