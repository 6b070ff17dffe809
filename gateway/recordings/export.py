"""Export of a recording as a log: the columns of a log, and the gateway's own columns.

A log has one row for each new sample of the PLC, timed by the PLC's clock. Ticks without a reading
and repeated samples have no row, because the time of a log increases and its values are finite.
"""

import csv
import gzip
from collections.abc import Callable, Set
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gateway.arrays import Array
from gateway.cycle.record import READ, WRITTEN
from gateway.errors import ConfigError
from gateway.recordings.recording import Recording
from register_maps import mdf4_log, parquet_log
from register_maps.log_table import Column, LogTableError
from register_maps.register_map import RegisterMap
from register_maps.signals import LOG_COLUMNS, SIGNALS
from register_maps.units import UNITS

Columns = dict[str, Any]
"""Column name with unit -> values."""

OWN: Final = {
    "tick": "tick",
    "demand_motor_speed_rad_s": "demand",
    "setpoint_motor_speed_rad_s": "setpoint_speed_setpoint",
    "sample_age_s": "age",
    "period_s": "period",
    "lateness_s": "lateness",
    "latency_s": "latency",
    "missed_deadlines": "missed",
    "dropped_records": "dropped",
}
SUFFIXES: Final = {
    "1": "",
    "s": "_s",
    "rad/s": "_rad_s",
    "N m": "_Nm",
    "N m s": "_Nms",
    "A": "_A",
    "V": "_V",
    "K": "_K",
}


def columns(recording: Recording, register_map: RegisterMap) -> Columns:
    """Every column that the recording can fill, by its name with unit."""
    rows = recording.records[new_samples(recording)]
    found: Columns = {}
    for column in LOG_COLUMNS.values():
        if column.measured is not None:
            unit = UNITS[column.unit]
            found[column.column] = (rows[f"measured_{column.measured}"] - unit.shift) / unit.factor
    found["time_s"] = unwrap_time(found["time_s"], register_map.modulus("plc_time"))
    found |= {name: rows[field] for name, field in OWN.items()}
    found["gateway_time_s"] = rows["now"] - recording.header["started"]
    found["written"] = (rows["flags"] & WRITTEN) > 0
    found["state"] = np.array([recording.state(code) for code in rows["state"]])
    found["reason"] = np.array([recording.reason(code) for code in rows["reason"]])
    found["fault"] = np.array([recording.reason(code) for code in rows["fault"]])
    found |= _other_signals(rows, {column.measured for column in LOG_COLUMNS.values()})
    return {name: values for name, values in found.items() if not _missing(values)}


def start_date(recording: Recording) -> datetime:
    """Date at which the time of the columns is zero: that of the first sample."""
    date = datetime.fromisoformat(recording.header["date"])
    rows = recording.records[new_samples(recording)]
    waited = float(rows["now"][0] - recording.header["started"]) if len(rows) else 0.0
    return date + timedelta(seconds=waited)


def new_samples(recording: Recording) -> NDArray[np.intp]:
    """Indices of the ticks that read a new sample."""
    read = np.flatnonzero(recording.records["flags"] & READ)
    samples = recording.records["measured_plc_time"][read]
    known = np.isfinite(samples)
    read, samples = read[known], samples[known]
    new: NDArray[np.intp] = read[np.diff(samples, prepend=np.nan) != 0.0]
    return new


def unwrap_time(time: Array, modulus: float | None) -> Array:
    """Time since the first sample [s] from a clock that wraps at `modulus` (None: never)."""
    steps = np.diff(time, prepend=time[:1])
    return np.cumsum(steps if modulus is None else np.mod(steps, modulus))


def _other_signals(rows: Any, taken: Set[str | None]) -> Columns:
    """Measured signals that are no column of a log, in SI."""
    return {
        f"{signal.name}{SUFFIXES[signal.unit]}": rows[f"measured_{signal.name}"]
        for signal in SIGNALS.values()
        if signal.kind == "measurement" and signal.name not in taken
    }


def _missing(values: Any) -> bool:
    return values.dtype.kind == "f" and bool(len(values)) and bool(np.isnan(values).all())


def write_csv(path: Path, found: Columns) -> None:
    """Write the columns as CSV so that reading gives the same numbers again."""
    opened: Callable[..., Any] = gzip.open if path.name.endswith(".gz") else open
    with opened(path, "wt", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(found)
        writer.writerows(
            zip(*(map(_text, values.tolist()) for values in found.values()), strict=True)
        )


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(int(value))
    return "" if value != value else str(value)  # noqa: PLR0124 - true for NaN, which is written as nothing


def with_units(found: Columns) -> list[Column]:
    """Columns with signal and unit apart, for files that keep the unit as metadata."""
    return [
        Column(name=signal, unit=unit, values=values)
        for (signal, unit), values in zip(map(split_unit, found), found.values(), strict=True)
    ]


def split_unit(column: str) -> tuple[str, str]:
    """Signal and unit in the name of a column."""
    if column in LOG_COLUMNS:
        return LOG_COLUMNS[column].signal, LOG_COLUMNS[column].unit
    # The longest, because _rad_s ends in _s; no suffix fits every name.
    fitting = {suffix: unit for unit, suffix in SUFFIXES.items() if column.endswith(suffix)}
    suffix = max(fitting, key=len)
    return column.removesuffix(suffix), fitting[suffix]


def write(path: Path, found: Columns, start: datetime) -> None:
    """Write the columns in the format of the file's ending. Raises ConfigError for another ending.

    start : date at which the time of the columns is zero
    """
    try:
        if path.name.endswith((".csv", ".csv.gz")):
            write_csv(path, found)
        elif path.name.endswith(".parquet"):
            path.write_bytes(parquet_log.encode(with_units(found)))
        elif path.name.endswith(".mf4"):
            path.write_bytes(mdf4_log.encode(with_units(found), start))
        else:
            raise ConfigError(
                "unknown format",
                place="--to",
                value=str(path),
                expected="one of .csv, .csv.gz, .parquet, .mf4",
            )
    except LogTableError as error:
        raise ConfigError(str(error), place="--to") from error
