"""A recording as a log: the log's columns, and the gateway's own beside them.

One row for each new sample of the PLC, timed by the PLC's clock: ticks without a reading, and
readings of a sample that was read before, have no row, because a log's time increases and its
values are finite.
"""

import csv
import gzip
import importlib
from collections.abc import Callable, Mapping, Set
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gateway.errors import ConfigError
from gateway.record import READ, WRITTEN
from gateway.recording import Recording
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
    """Every column that the recording can fill."""
    rows = recording.records[fresh(recording)]
    found: Columns = {}
    for column in LOG_COLUMNS.values():
        if column.measured is not None:
            unit = UNITS[column.unit]
            found[column.column] = (rows[f"measured_{column.measured}"] - unit.shift) / unit.factor
    found["time_s"] = elapsed(found["time_s"], register_map.modulus("plc_time"))
    found |= {name: rows[field] for name, field in OWN.items()}
    found["gateway_time_s"] = rows["now"] - recording.header["started"]
    found["written"] = (rows["flags"] & WRITTEN) > 0
    found["state"] = np.array([recording.state(code) for code in rows["state"]])
    found["reason"] = np.array([recording.reason(code) for code in rows["reason"]])
    found["fault"] = np.array([recording.reason(code) for code in rows["fault"]])
    found |= _other_signals(rows, {column.measured for column in LOG_COLUMNS.values()})
    return {name: values for name, values in found.items() if not _missing(values)}


def fresh(recording: Recording) -> NDArray[np.intp]:
    """Ticks that read a sample which no tick before had read."""
    read = np.flatnonzero(recording.records["flags"] & READ)
    samples = recording.records["measured_plc_time"][read]
    known = np.isfinite(samples)
    read, samples = read[known], samples[known]
    new: NDArray[np.intp] = read[np.diff(samples, prepend=np.nan) != 0.0]
    return new


def elapsed(time: NDArray[np.float64], modulus: float | None) -> NDArray[np.float64]:
    """Time since the first sample, the PLC's clock unwrapped [s]."""
    steps = np.diff(time, prepend=time[:1])
    return np.cumsum(steps if modulus is None else np.mod(steps, modulus))


def _other_signals(rows: Any, taken: Set[str | None]) -> Columns:
    """Measured signals that have no column in a log, in SI."""
    return {
        f"{signal.name}{SUFFIXES[signal.unit]}": rows[f"measured_{signal.name}"]
        for signal in SIGNALS.values()
        if signal.kind == "measurement" and signal.name not in taken
    }


def _missing(values: Any) -> bool:
    return values.dtype.kind == "f" and bool(len(values)) and bool(np.isnan(values).all())


def write_csv(path: Path, found: Columns) -> None:
    """Write the columns so that reading them gives the same numbers."""
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
    return "" if value != value else str(value)  # noqa: PLR0124 - NaN: there is none


def write_parquet(path: Path, found: Columns) -> None:
    """Write a Parquet file, the unit of each column in its metadata."""
    arrow, parquet = _extra("pyarrow", "parquet"), _extra("pyarrow.parquet", "parquet")
    fields = [
        arrow.field(signal, arrow.array(values).type, metadata={"unit": unit})
        for (signal, unit), values in zip(map(split_unit, found), found.values(), strict=True)
    ]
    arrays = [arrow.array(values) for values in found.values()]
    parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields)), path)


def write_mdf4(path: Path, found: Columns) -> None:
    """Write an MDF4 file, the unit at each channel."""
    asammdf = _extra("asammdf", "mdf4")
    signals = [
        asammdf.Signal(
            samples=values.astype("S") if values.dtype.kind == "U" else values,
            timestamps=found["time_s"],
            name=signal,
            unit=unit,
            encoding="utf-8",
        )
        for (signal, unit), values in zip(map(split_unit, found), found.values(), strict=True)
        if signal != "time"
    ]
    with asammdf.MDF(version="4.10") as file:
        file.append(signals, comment="exported recording")
        file.save(path, overwrite=True)


def split_unit(column: str) -> tuple[str, str]:
    """Signal and unit of a column's name."""
    if column in LOG_COLUMNS:
        return LOG_COLUMNS[column].signal, LOG_COLUMNS[column].unit
    for unit, suffix in SUFFIXES.items():
        if suffix and column.endswith(suffix):
            return column.removesuffix(suffix), unit
    return column, "1"


def _extra(module: str, extra: str) -> Any:
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise ConfigError(
            f"this form needs {module}",
            place="--to",
            expected=f"pip install 'road-load-bench[{extra}]', or a file that ends in .csv",
        ) from None


WRITERS: Final[Mapping[str, Callable[[Path, Columns], None]]] = {
    ".csv": write_csv,
    ".csv.gz": write_csv,
    ".parquet": write_parquet,
    ".mf4": write_mdf4,
}


def write(path: Path, found: Columns) -> None:
    """Write the columns in the form that the file's name asks for."""
    for ending, writer in WRITERS.items():
        if path.name.endswith(ending):
            return writer(path, found)
    raise ConfigError(
        "unknown form", place="--to", value=str(path), expected=f"one of {', '.join(WRITERS)}"
    )
