"""Strict reader of a CSV log in bytes, which both programs use.

The text is UTF-8, with or without a byte order mark, with commas and one header line. It may be
gzip-compressed, which the content tells, and a cell may be in quotes. The name of a column contains
its unit; the values of the result are SI. `log_table` says what a log must hold. No file is opened
here.
"""

import csv
import gzip
import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from register_maps.logs.log_table import (
    LogTable,
    LogTableError,
    check_count,
    check_header,
    check_samples,
    si,
)
from register_maps.signals import LOG_COLUMNS, LogColumn

GZIP: Final = b"\x1f\x8b"
TIME: Final = "time_s"
CsvLogError = LogTableError
"""Name of the error for readers that know CSV only."""

Rows = list[tuple[int, list[str]]]
"""Line number and cells of every line that is not blank."""


def parse(data: bytes, columns: Mapping[str, LogColumn] = LOG_COLUMNS) -> LogTable:
    """Log in these bytes. Raises LogTableError with line and column.

    columns : allowed columns by their names, among them `time_s`
    """
    header, *rows = _rows(_text(data)) or [(1, [])]
    names = [name.strip() for name in header[1]]
    check_header(names, columns, f"line {header[0]}: ")
    check_count(len(rows))
    known = {name: k for k, name in enumerate(names) if name in columns}
    table = _columns(rows, known, len(names))
    check_samples(
        table,
        TIME,
        {name: columns[name].unit for name in table},
        lambda row: f"line {rows[row][0]}",
        lambda row, name: rows[row][1][known[name]].strip(),
    )
    signals = {columns[name].signal: si(columns[name], values) for name, values in table.items()}
    return LogTable(signals=signals, other=tuple(name for name in names if name not in columns))


def _text(data: bytes) -> str:
    try:
        return (gzip.decompress(data) if data.startswith(GZIP) else data).decode("utf-8-sig")
    except (OSError, EOFError, zlib.error) as error:
        raise LogTableError(f"damaged gzip file ({error})") from error
    except UnicodeDecodeError as error:
        raise LogTableError(f"byte {error.start}: not UTF-8 text") from error


def _rows(text: str) -> Rows:
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if '"' in text:
        return list(_split_quoted(lines))
    return [(k, line.split(",")) for k, line in enumerate(lines, start=1) if line.strip()]


def _split_quoted(lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of each line of a text with quotes."""
    reader = csv.reader(lines, strict=True)
    try:
        for cells in reader:
            if len(cells) > 1 or any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as error:
        raise LogTableError(f"line {reader.line_num}: {error}") from error


def _columns(rows: Rows, known: dict[str, int], width: int) -> dict[str, list[float]]:
    """Known columns by name, in their own units."""
    try:
        table = list(zip(*(cells for _, cells in rows), strict=True))
        if len(table) == width:
            return {name: list(map(_number, table[k])) for name, k in known.items()}
    except ValueError:
        pass  # a row of another length or no number: `_first_fault` finds its line
    raise _first_fault(rows, known, width)


def _number(cell: str) -> float:
    """A decimal number. `float` alone would also read 1_000 and the digits of other scripts."""
    if "_" in cell or not cell.isascii():
        raise ValueError(cell)
    return float(cell)


def _first_fault(rows: Rows, known: dict[str, int], width: int) -> LogTableError:
    """Error for the first row of another length or cell without a number, with its place."""
    for line, cells in rows:
        if len(cells) != width:
            return LogTableError(f"line {line}: {len(cells)} values; {width} columns are expected")
        for name, k in known.items():
            if not _is_number(cells[k]):
                found = cells[k]
                return LogTableError(f"line {line}, column {name}: {found!r}; expected a number")
    raise AssertionError("a table that was refused has no fault")


def _is_number(cell: str) -> bool:
    try:
        _number(cell)
    except ValueError:
        return False
    return True
