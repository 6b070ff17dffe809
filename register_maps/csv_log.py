"""A CSV log as bytes, read strictly: daemon and physics read every log through this one reader.

UTF-8 (a byte order mark may stand before it), comma, one header line, plain or gzip-compressed by
content; a cell may stand in quotes. The unit stands in the column's name, what comes out is SI.
What may stand in a log is told by `signals.LOG_COLUMNS`. A column that is none of them is named and
left alone; one that names a signal in another unit is refused where the right one is missing,
because its signal would be taken for missing too. No file is opened here.
"""

import csv
import gzip
import re
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, isfinite
from typing import Final

from register_maps.signals import LOG_COLUMNS, LogColumn
from register_maps.units import UNITS

GZIP: Final = b"\x1f\x8b"
TIME: Final = "time_s"
UNIT_SUFFIX: Final = re.compile(
    r"(_?(s|ms|us|min|h|rpm|1_min|min_1|rev_s|rad_s|deg_s|rad|deg|m|mm|m_s|km_h|kmh|Hz|m?Nm|kNm|N|lbft"
    r"|[mk]?A|[mk]?V|degC|degF|[CFK]))?"
)

Rows = list[tuple[int, list[str]]]
"""Line number and cells of every line that is not blank."""


class CsvLogError(Exception):
    """A log that may not be used: line, column, what was found and what was expected."""


@dataclass(frozen=True, kw_only=True)
class CsvLog:
    """Signals by name, SI, `time` among them, all of one length; `other`: columns of no signal."""

    signals: dict[str, list[float]]
    other: tuple[str, ...]


def parse(data: bytes, columns: Mapping[str, LogColumn] = LOG_COLUMNS) -> CsvLog:
    """The log in these bytes. columns : by name, what may stand in it; `time_s` among them"""
    rows = _rows(_text(data))
    line, header = rows[0] if rows else (1, [])
    names = [name.strip() for name in header]
    _check_header(line, names, columns)
    if len(rows) < 3:
        raise CsvLogError(f"{len(rows) - 1} samples; at least 2 are needed")
    known = {k: name for k, name in enumerate(names) if name in columns}
    table = _columns(rows[1:], known, len(names))
    if table is None:
        raise _first_fault(rows[1:], known, len(names))
    signals = {columns[name].signal: _si(columns[name], values) for name, values in table.items()}
    return CsvLog(signals=signals, other=tuple(name for name in names if name not in columns))


def _text(data: bytes) -> str:
    try:
        return (gzip.decompress(data) if data.startswith(GZIP) else data).decode("utf-8-sig")
    except (OSError, EOFError, zlib.error) as error:
        raise CsvLogError(f"damaged gzip file ({error})") from error
    except UnicodeDecodeError as error:
        raise CsvLogError(f"byte {error.start}: not UTF-8 text") from error


def _rows(text: str) -> Rows:
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if '"' in text:
        return list(_quoted(lines))
    return [(k, line.split(",")) for k, line in enumerate(lines, start=1) if line.strip()]


def _quoted(lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
    """The cells of a text in which some stand in quotes."""
    reader = csv.reader(lines, strict=True)
    try:
        for cells in reader:
            if len(cells) > 1 or any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as error:
        raise CsvLogError(f"line {reader.line_num}: {error}") from error


def _check_header(line: int, names: Sequence[str], columns: Mapping[str, LogColumn]) -> None:
    for name in names:
        if name in columns and names.count(name) > 1:
            raise CsvLogError(f"line {line}: column {name} stands twice")
    absent = [column for column in columns.values() if column.column not in names]
    for column in absent:
        for name in names:
            rest = name.removeprefix(column.signal)
            if rest != name and UNIT_SUFFIX.fullmatch(rest):
                raise CsvLogError(f"line {line}: column {name}; expected {column.column}")
    for column in absent:
        if column.needed:
            raise CsvLogError(f"line {line}: column {column.column} is missing; it is needed")


def _columns(rows: Rows, known: dict[int, str], width: int) -> dict[str, list[float]] | None:
    """The known columns, in their own units; None where a row, a number or the time is bad."""
    if any(len(cells) != width for _, cells in rows):
        return None
    table = list(zip(*(cells for _, cells in rows), strict=True))
    try:
        columns = {name: list(map(_number, table[k])) for k, name in known.items()}
    except ValueError:
        return None
    finite = all(all(map(isfinite, values)) for values in columns.values())
    later = all(a < b for a, b in pairwise(columns[TIME]))
    return columns if finite and later else None


def _number(cell: str) -> float:
    """A decimal number; Python alone would also read 1_000 and the digits of other scripts."""
    if "_" in cell or not cell.isascii():
        raise ValueError(cell)
    return float(cell)


def _first_fault(rows: Rows, known: dict[int, str], width: int) -> CsvLogError:
    """The first fault of the table, with line and column; found cell by cell."""
    before = -inf
    for line, cells in rows:
        if len(cells) != width:
            return CsvLogError(f"line {line}: {len(cells)} values; {width} columns are expected")
        for k, name in known.items():
            if expected := _lacking(cells[k]):
                found = cells[k]
                return CsvLogError(f"line {line}, column {name}: {found!r}; expected {expected}")
            if name == TIME and float(cells[k]) <= before:
                found = cells[k].strip()
                return CsvLogError(
                    f"line {line}, column {name}: {found} after {before:g}; "
                    "time must increase strictly"
                )
            before = float(cells[k]) if name == TIME else before
    raise AssertionError("a table that was refused has no fault")


def _lacking(cell: str) -> str:
    """What a cell should have been; nothing where it is a finite number."""
    try:
        return "" if isfinite(_number(cell)) else "a finite number"
    except ValueError:
        return "a number"


def _si(column: LogColumn, values: list[float]) -> list[float]:
    unit = UNITS[column.unit]
    return values if unit.si == column.unit else [unit.to_si(v) for v in values]
