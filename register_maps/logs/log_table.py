"""Rules for every log in any file format: known names and units, numbers, increasing time.

The name of a column contains its unit: `motor_speed_rad_s` in CSV, `motor_speed [rad/s]` where the
unit is metadata. `signals.LOG_COLUMNS` has the columns of a log. Any other column is named and
ignored. A column with a signal in a wrong unit is refused where the right column is missing,
because its signal would otherwise count as missing.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, isfinite
from statistics import median
from typing import Any, Final

from register_maps.signals import LOG_COLUMNS, LogColumn
from register_maps.units import UNITS

WITH_METADATA: Final = {f"{c.signal} [{c.unit}]": c for c in LOG_COLUMNS.values()}
"""Columns of a log by their names in files that keep the unit as metadata."""
SAME_UNIT: Final = {"Nm": "N m", "N*m": "N m", "N\u00b7m": "N m", "\u00b0C": "degC"}
"""Spellings of units by other programs, and ours."""
LARGEST: Final = {"s": 1e10, "rad/s": 1e4, "N m": 1e6, "A": 1e5, "V": 1e5, "degC": 1e4, "m/s": 1e3}
"""Largest value by unit, far above any bench or truck: a larger value is a fault of the log."""
FASTEST, SLOWEST = 1e-4, 10.0
"""[s] Shortest and longest time between two samples; the clock of a logger may be 1 % off."""
UNIT: Final = re.compile(
    r"(_?(s|ms|us|min|h|rpm|1_min|min_1|rev_s|rad_s|deg_s|rad|deg|m|mm|m_s|km_h|kmh|Hz|m?Nm|kNm|N|lbft"
    r"|[mk]?A|[mk]?V|degC|degF|[CFK]))?( \[.*\])?"
)


class LogTableError(Exception):
    """A log that cannot be used: line or row, column, value found and value expected."""


@dataclass(frozen=True, kw_only=True)
class LogTable:
    """Signals of a log by name in SI, `time` among them, of one length; other : unknown columns."""

    signals: dict[str, list[float]]
    other: tuple[str, ...]


def with_metadata(name: str, unit: str) -> str:
    """Name of a column whose unit is metadata. Without a unit, the name itself may contain it."""
    unit = SAME_UNIT.get(unit.strip(), unit.strip())
    if name in LOG_COLUMNS:
        name, unit = LOG_COLUMNS[name].signal, unit or LOG_COLUMNS[name].unit
    return f"{name} [{unit}]" if unit else name


def check_header(names: Sequence[str], columns: Mapping[str, LogColumn], place: str = "") -> None:
    """Refuse a repeated column, a wrong unit and a missing needed column. Raises LogTableError."""
    for name in names:
        if name in columns and names.count(name) > 1:
            raise LogTableError(f"{place}column {name} stands twice")
    absent = {wanted: column for wanted, column in columns.items() if wanted not in names}
    for wanted, column in absent.items():
        for name in names:
            rest = name.removeprefix(column.signal)
            if rest != name and UNIT.fullmatch(rest):
                raise LogTableError(f"{place}column {name}; expected {wanted}")
    for wanted, column in absent.items():
        if column.needed:
            raise LogTableError(f"{place}column {wanted} is missing; it is needed")


def check_count(samples: int) -> None:
    """Refuse a log of fewer than two samples."""
    if samples < 2:
        raise LogTableError(f"{samples} samples; at least 2 are needed")


def check_samples(
    columns: Mapping[str, Sequence[float]],
    time: str,
    units: Mapping[str, str],
    place: Callable[[int], str],
    shown: Callable[[int, str], object],
) -> None:
    """Refuse values that are not finite or impossibly large, and a time that does not increase.

    time : name of the column of the time; units : of each column, by name
    place, shown : text of an error for a row, and for a value by row and name
    """
    largest = {name: LARGEST.get(units[name], inf) for name in columns}
    later = all(a < b for a, b in pairwise(columns[time]))
    if later and all(_within(values, largest[name]) for name, values in columns.items()):
        return
    for row, values in enumerate(zip(*columns.values(), strict=True)):
        for name, value in zip(columns, values, strict=True):
            where = f"{place(row)}, column {name}: "
            if not isfinite(value):
                raise LogTableError(f"{where}{shown(row, name)!r}; expected a finite number")
            if abs(value) > largest[name]:
                raise LogTableError(
                    f"{where}{shown(row, name)}; expected {-largest[name]:g} .. {largest[name]:g}"
                )
        before, now = columns[time][max(row - 1, 0)], columns[time][row]
        if row and now <= before:
            raise LogTableError(
                f"{place(row)}, column {time}: {shown(row, time)} after {before:g}; "
                "time must increase strictly"
            )


def _within(values: Sequence[float], largest: float) -> bool:
    return all(map(isfinite, values)) and -largest <= min(values) and max(values) <= largest


def check_sampling(times: Sequence[float]) -> None:
    """Refuse a log of the bench with an impossible sample time or a long hole; times [s]."""
    steps = [later - before for before, later in pairwise(times)]
    interval = median(steps)
    if not 0.99 * FASTEST <= interval <= SLOWEST:
        raise LogTableError(
            f"a sample every {interval:g} s; expected one every {FASTEST:g} .. {SLOWEST:g} s"
        )
    widest = max(range(len(steps)), key=steps.__getitem__)
    if steps[widest] > SLOWEST:
        raise LogTableError(
            f"no sample from {times[widest]:g} s to {times[widest + 1]:g} s; "
            f"expected one every {SLOWEST:g} s or faster"
        )


def si(column: LogColumn, values: Sequence[float]) -> list[float]:
    """Values of a column in the SI unit of its signal."""
    unit = UNITS[column.unit]
    return list(values) if unit.si == column.unit else [unit.to_si(v) for v in values]


def table(names: Sequence[str], numbers: Callable[[int], list[float]]) -> LogTable:
    """Log of a file that keeps units as metadata. Raises LogTableError.

    names : of its columns, from `with_metadata`; numbers : values of a column by its index
    """
    check_header(names, WITH_METADATA)
    columns = {name: numbers(k) for k, name in enumerate(names) if name in WITH_METADATA}
    lengths = sorted({len(values) for values in columns.values()})
    if len(lengths) > 1:
        raise LogTableError(
            f"columns of {lengths[0]} and {lengths[-1]} samples; expected one length"
        )
    check_count(lengths[0])
    check_samples(
        columns,
        with_metadata("time_s", ""),
        {name: WITH_METADATA[name].unit for name in columns},
        lambda row: f"row {row + 1}",
        lambda row, name: columns[name][row],
    )
    signals = {
        WITH_METADATA[name].signal: si(WITH_METADATA[name], values)
        for name, values in columns.items()
    }
    return LogTable(signals=signals, other=tuple(n for n in names if n not in WITH_METADATA))


def without_package(form: str, package: str, extra: str) -> LogTableError:
    """Error for a missing package that reads and writes this format."""
    return LogTableError(
        f"{form} needs {package}, which is not installed; expected pip install "
        f"'road-load-bench[{extra}]', or a CSV log"
    )


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column to write: NumPy array of numbers, booleans or texts, and its unit (empty: none)."""

    name: str
    unit: str
    values: Any
