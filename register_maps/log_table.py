"""What every log has to hold, whatever its file: known names and units, numbers, increasing time.

A column is called by its name and its unit together, as its file tells them: `motor_speed_rad_s` in
CSV, `motor_speed [rad/s]` where the unit is metadata. What may stand in a log is told by
`signals.LOG_COLUMNS`. A column that is none of them is named and left alone; one that names a
signal in another unit is refused where the right one is missing, because its signal would be taken
for missing too.
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
"""The log's columns as files call them that hold the unit as metadata."""
SAME_UNIT: Final = {"Nm": "N m", "N*m": "N m", "N\u00b7m": "N m", "\u00b0C": "degC"}
"""Other spellings of the same units, as other programs write them."""
LARGEST: Final = {"s": 1e10, "rad/s": 1e4, "N m": 1e6, "A": 1e5, "V": 1e5, "degC": 1e4, "m/s": 1e3}
"""By unit, far more than any bench or truck shows: a value beyond it is a fault of the log."""
FASTEST, SLOWEST = 1e-4, 10.0
"""[s] Between two samples of a bench; a logger's clock may be 1 % off."""
UNIT: Final = re.compile(
    r"(_?(s|ms|us|min|h|rpm|1_min|min_1|rev_s|rad_s|deg_s|rad|deg|m|mm|m_s|km_h|kmh|Hz|m?Nm|kNm|N|lbft"
    r"|[mk]?A|[mk]?V|degC|degF|[CFK]))?( \[.*\])?"
)


class LogTableError(Exception):
    """A log that may not be used: line or row, column, what was found and what was expected."""


@dataclass(frozen=True, kw_only=True)
class LogTable:
    """Signals by name, SI, `time` among them, all of one length; `other`: columns of no signal."""

    signals: dict[str, list[float]]
    other: tuple[str, ...]


def with_metadata(name: str, unit: str) -> str:
    """What a column is called whose unit is metadata; where there is none its name may hold it."""
    unit = SAME_UNIT.get(unit.strip(), unit.strip())
    if name in LOG_COLUMNS:
        name, unit = LOG_COLUMNS[name].signal, unit or LOG_COLUMNS[name].unit
    return f"{name} [{unit}]" if unit else name


def check_header(names: Sequence[str], columns: Mapping[str, LogColumn], place: str = "") -> None:
    """Refuse names of which one stands twice, has a wrong unit, or is missing and needed."""
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
    """Refuse a log that holds no interval of time."""
    if samples < 2:
        raise LogTableError(f"{samples} samples; at least 2 are needed")


def check_samples(
    columns: Mapping[str, Sequence[float]],
    time: str,
    units: Mapping[str, str],
    place: Callable[[int], str],
    shown: Callable[[int, str], object],
) -> None:
    """Refuse values that are not finite or that nothing shows, and a time that does not increase.

    time : name of its column; units : of each column, by name
    place, shown : what an error calls a row, and a value by row and name
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
    """Refuse a log of the bench that is sampled as no bench is, or that has a long hole [s]."""
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
    """The values of a column in the SI unit of its signal."""
    unit = UNITS[column.unit]
    return list(values) if unit.si == column.unit else [unit.to_si(v) for v in values]


def table(names: Sequence[str], numbers: Callable[[int], list[float]]) -> LogTable:
    """The log in a file that holds units as metadata.

    names : of its columns, by `with_metadata`; numbers : values of a column by its place
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
    """What to tell where the package is missing that reads and writes this form."""
    return LogTableError(
        f"{form} needs {package}, which is not installed; expected pip install "
        f"'road-load-bench[{extra}]', or a CSV log"
    )


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column to be written: NumPy array of numbers, truths or texts, and its unit ("": none)."""

    name: str
    unit: str
    values: Any
