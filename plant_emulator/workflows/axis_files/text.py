"""Text files as tables: comma, semicolon, tab, bar or spaces, decimal point or comma.

Lines before the names of the columns, comment lines and blank lines are left out. A line below the
names may hold the units. The separator is the one by which most cells are numbers. A file without
names has the columns 1, 2, 3, ...
"""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.workflows.axis_files.table import Table
from register_maps.logs.csv_log import GZIP

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

SEPARATORS = (",", ";", "\t", "|", "")
COMMENT = re.compile(r"\s*(#|%|//)+\s*")
NUMBER = re.compile(
    r"\s*[-+]?(\d+[.,]?\d*|[.,]\d+)(e[-+]?\d+)?\s*|\s*[-+]?(nan|inf)\s*", re.IGNORECASE
)
# Lines by whose cells the separator is found.
SAMPLE = 40


@dataclass(frozen=True, kw_only=True)
class Line:
    """Number of a line in its file, and its cells."""

    number: int
    cells: list[str]


def table(data: bytes, path: str) -> Table:
    """The table of a text file in these bytes, plain or gzip; raises LogError."""
    lines = list(enumerate(_text(data, path).splitlines(), start=1))
    written = [(k, line) for k, line in lines if line.strip()]
    plain = [(k, line) for k, line in written if not COMMENT.match(line)]
    separator, width = _layout([line for _, line in plain[-SAMPLE:]], path)
    rows = [Line(number=k, cells=_cells(line, separator)) for k, line in plain]
    first = next(k for k, row in enumerate(rows) if _holds_numbers(row, width))
    above = [row for row in rows[:first] if len(row.cells) == width]
    comments = [
        Line(number=k, cells=_cells(COMMENT.sub("", line, count=1), separator))
        for k, line in written
        if k < rows[first].number and COMMENT.match(line)
    ]
    heads = (above or [row for row in comments if len(row.cells) == width])[-2:]
    names = tuple(heads[0].cells) if heads else tuple(str(k + 1) for k in range(width))
    if doubled := [name for name, count in Counter(names).items() if count > 1]:
        raise LogError(f"{path}: line {heads[0].number}: column {doubled[0]} stands twice")
    body = rows[first:]

    def take(wanted: Sequence[str]) -> list[Array]:
        return _columns(body, names, wanted, path, decimal_comma=separator != ",")

    return Table(
        path=path,
        header=f"line {heads[0].number}" if heads else "no names",
        names=names,
        units=dict(zip(names, heads[1].cells, strict=True)) if len(heads) == 2 else {},
        take=take,
        row=lambda row: f"line {body[row].number}",
    )


def _text(data: bytes, path: str) -> str:
    try:
        raw = gzip.decompress(data) if data.startswith(GZIP) else data
    except (OSError, EOFError, zlib.error) as error:
        raise LogError(f"{path}: damaged gzip file ({error})") from error
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16", "replace")
    if b"\0" in raw:
        raise LogError(f"{path}: no text file; CSV, MATLAB, Parquet or MDF4 is expected")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def _layout(lines: Sequence[str], path: str) -> tuple[str, int]:
    """Separator and number of columns by which most cells of these lines are numbers."""
    best, found = 0.0, (",", 0)
    for separator in SEPARATORS:
        rows = [_cells(line, separator) for line in lines]
        width, count = Counter(map(len, rows)).most_common(1)[0] if rows else (0, 0)
        numbers = sum(bool(NUMBER.fullmatch(cell)) for row in rows for cell in row)
        share = count / max(1, len(rows)) * numbers / max(1, sum(map(len, rows)))
        if width > 1 and share > best:
            best, found = share, (separator, width)
    if best == 0.0:
        raise LogError(
            f"{path}: no table of numbers; columns divided by comma, semicolon, tab, bar or "
            "spaces are expected"
        )
    return found


def _cells(line: str, separator: str) -> list[str]:
    if not separator:
        return line.split()
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    return [cell.strip() for cell in line.split(separator)]


def _holds_numbers(row: Line, width: int) -> bool:
    """Whether at least half of the cells of a whole row are numbers."""
    return len(row.cells) == width and 2 * sum(map(_is_number, row.cells)) >= width


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(cell) is not None


def _columns(
    rows: Sequence[Line],
    names: Sequence[str],
    wanted: Sequence[str],
    path: str,
    *,
    decimal_comma: bool,
) -> list[Array]:
    """The wanted columns as numbers; raises LogError with line and column."""
    for row in rows:
        if len(row.cells) != len(names):
            raise LogError(
                f"{path}: line {row.number}: {len(row.cells)} values; "
                f"{len(names)} columns are expected"
            )
    found = []
    for name in wanted:
        place = list(names).index(name)
        cells = [row.cells[place] for row in rows]
        if not all(map(_is_number, cells)):
            bad = next(row for row in rows if not _is_number(row.cells[place]))
            raise LogError(
                f"{path}: line {bad.number}, column {name}: {bad.cells[place]!r}; expected a number"
            )
        points = [cell.replace(",", ".") for cell in cells] if decimal_comma else cells
        found.append(np.array(points, dtype=np.float64))
    return found
