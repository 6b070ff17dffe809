"""CSV logs, read strictly: the unit stands in the column's name, inside all is SI.

What may stand in a log is told by register_maps.signals.LOG_COLUMNS. A column that is none of them
is kept out of the way of the reader, so that a log may carry more; one that names a known signal
in another unit is refused, because it would be read as missing.
"""

import csv
import gzip
import math
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TextIO

import numpy as np

from gateway.errors import ConfigError
from register_maps.signals import LOG_COLUMNS, LogColumn
from register_maps.units import UNITS

Column = np.ndarray[Any, np.dtype[np.float64]]
TIME: Final = "time_s"
UNIT_SUFFIX: Final = re.compile(
    r"(_?(s|ms|us|min|h|rpm|1_min|min_1|rev_s|rad_s|deg_s|rad|deg|m|mm|m_s|km_h|kmh|Hz|m?Nm|kNm|N|lbft"
    r"|[mk]?A|[mk]?V|degC|degF|[CFK]))?"
)


class LogError(ConfigError):
    """A log that may not be used: file, line, column, and what was expected."""


@dataclass(frozen=True, kw_only=True)
class Log:
    """A log in SI: `columns` by signal name, each as long as `time` [s]."""

    path: Path
    time: Column
    columns: dict[str, Column]

    def missing(self) -> list[str]:
        """Optional columns that are not there."""
        return [
            column.column
            for column in LOG_COLUMNS.values()
            if column.signal not in self.columns and column.signal != "time"
        ]


def read(path: Path) -> Log:
    """The log in a .csv or .csv.gz file."""
    try:
        with _opened(path) as file:
            rows = csv.reader(file)
            header = next(rows, [])
            known = _known(path, header)
            table = list(_rows(path, _of_width(path, rows, len(header)), known))
    except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
        raise LogError(str(error), file=path, expected="a CSV log in UTF-8") from error
    if len(table) < 2:
        raise LogError("too short", file=path, value=len(table), expected="at least 2 samples")
    values = np.array(table)
    columns = {
        column.signal: values[:, index] * UNITS[column.unit].factor + UNITS[column.unit].shift
        for index, column in enumerate(known.values())
    }
    return Log(path=path, time=columns.pop("time"), columns=columns)


def _opened(path: Path) -> TextIO:
    if path.name.endswith(".gz"):
        return gzip.open(path, "rt", encoding="utf-8", newline="")
    return path.open(encoding="utf-8", newline="")


def _known(path: Path, header: list[str]) -> dict[int, LogColumn]:
    """Position -> column, for the columns that a log may have."""
    known: dict[int, LogColumn] = {}
    for position, name in enumerate(header):
        column = LOG_COLUMNS.get(name)
        if column in known.values():
            raise _refusal(path, 1, name, "stands twice", expected="it once")
        if column is not None:
            known[position] = column
        else:
            _refuse_other_unit(path, name)
    for column in LOG_COLUMNS.values():
        if column.needed and column not in known.values():
            raise _refusal(path, 1, column.column, "is missing", expected="it in the first line")
    return known


def _refuse_other_unit(path: Path, name: str) -> None:
    for column in LOG_COLUMNS.values():
        rest = name.removeprefix(column.signal)
        if rest != name and UNIT_SUFFIX.fullmatch(rest):
            raise _refusal(path, 1, name, "wrong unit suffix", expected=column.column)


def _of_width(path: Path, rows: Iterator[list[str]], width: int) -> Iterator[list[str]]:
    for line, row in enumerate(rows, start=2):
        if len(row) != width:
            raise LogError(
                "bad line", file=f"{path}:{line}", value=len(row), expected=f"{width} values"
            )
        yield row


def _rows(
    path: Path, rows: Iterator[list[str]], known: dict[int, LogColumn]
) -> Iterator[list[float]]:
    before = -math.inf
    for line, row in enumerate(rows, start=2):
        values = [_number(path, line, row, position, column) for position, column in known.items()]
        time = values[list(known.values()).index(LOG_COLUMNS[TIME])]
        if time <= before:
            raise _refusal(
                path, line, TIME, "does not increase", expected=f"more than {before}", value=time
            )
        before = time
        yield values


def _number(path: Path, line: int, row: list[str], position: int, column: LogColumn) -> float:
    text = row[position]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _refusal(
            path, line, column.column, "bad value", expected="a finite number", value=text
        )
    return value


def _refusal(
    path: Path, line: int, column: str, what: str, *, expected: str, value: object = None
) -> LogError:
    return LogError(
        what, file=f"{path}:{line}", place=f"column {column}", value=value, expected=expected
    )
