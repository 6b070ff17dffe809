"""Reads a run of a single motor-driven axis: a CSV file, or a MATLAB file of a known bench.

CSV: `time_s`, and `position_m` with `force_N`, or `position_rad` with `torque_Nm`; gzip or plain.
The variables of a MATLAB file say which bench it is of:

    t, qm, vir, gtau    a position-controlled screw: position [m], command [V], gain [N/V];
                        force = gtau vir, which already includes `pulses_N`
    data, Cu            a motor bench: seven columns time [s], reference, position [rad], speed,
                        torque command, torque [N m], current [A]; torque = Cu current
"""

from __future__ import annotations

import gzip
import zlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.signals.axis_log import AxisLog
from register_maps.csv_log import GZIP, TIME, CsvLogError, parse
from register_maps.signals import LOG_COLUMNS, LogColumn

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

MATLAB = b"MATLAB"
SCREW = ("t", "qm", "vir", "gtau")
MOTOR = ("data", "Cu")
MOTOR_COLUMNS = 7


def read(path: str | Path) -> AxisLog:
    """The run in that file; LogError says file, line or variable, and what was expected."""
    path = Path(path)
    if not path.is_file():
        raise LogError(f"{path}: no such file; a log of an axis is needed")
    data = path.read_bytes()
    return _matlab(path) if data.startswith(MATLAB) else _csv(data, path)


def _column(column: str, signal: str, unit: str) -> LogColumn:
    return LogColumn(
        column=column, signal=signal, unit=unit, needed=True, measured=None, decimals=6
    )


LINEAR = (_column("position_m", "position", "m"), _column("force_N", "force", "N"))
ROTARY = (_column("position_rad", "position", "rad"), _column("torque_Nm", "torque", "N m"))


def _csv(data: bytes, path: Path) -> AxisLog:
    rotary = any(column.column.encode() in _header(data) for column in ROTARY)
    position, force = ROTARY if rotary else LINEAR
    columns = {c.column: c for c in (LOG_COLUMNS[TIME], position, force)}
    try:
        found = parse(data, columns)
    except CsvLogError as error:
        raise LogError(f"{path}: {error}") from error
    time, q, f = (np.array(found.signals[name]) for name in ("time", position.signal, force.signal))
    return AxisLog(
        time=time, position=q, force=f, rotary=rotary, source=str(path), other=found.other
    )


def _header(data: bytes) -> bytes:
    """First line of a CSV file; empty for a damaged file, which the reader refuses."""
    try:
        text = gzip.decompress(data) if data.startswith(GZIP) else data
    except (OSError, EOFError, zlib.error):
        return b""
    return text.split(b"\n", 1)[0]


def _matlab(path: Path) -> AxisLog:
    from scipy.io import loadmat

    try:
        found = loadmat(path)
    except Exception as error:
        raise LogError(f"{path}: no readable MATLAB file up to version 7 ({error})") from error
    other = tuple(name for name in found if not name.startswith("__"))
    if all(name in found for name in SCREW):
        time, position, voltage = (_vector(found, name, path) for name in SCREW[:3])
        force = voltage * _number(found, "gtau", path)
        return replace(_log(path, time, position, force, rotary=False), other=other)
    if all(name in found for name in MOTOR):
        table = _numbers(found, "data", path)
        if table.ndim != 2 or table.shape[1] != MOTOR_COLUMNS:
            raise LogError(f"{path}: data has shape {table.shape}; {MOTOR_COLUMNS} columns needed")
        torque = table[:, 6] * _number(found, "Cu", path)
        return replace(_log(path, table[:, 0], table[:, 2], torque, rotary=True), other=other)
    raise LogError(
        f"{path}: variables {', '.join(sorted(other))}; known: {', '.join(SCREW)}, "
        f"or {', '.join(MOTOR)}; write any other log as CSV"
    )


def _numbers(found: dict[str, Any], name: str, path: Path) -> Array:
    try:
        return np.asarray(found[name], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise LogError(f"{path}: {name} holds no numbers") from error


def _vector(found: dict[str, Any], name: str, path: Path) -> Array:
    values = _numbers(found, name, path)
    if values.size != max(values.shape, default=0):
        raise LogError(f"{path}: {name} has shape {values.shape}; one row or column is needed")
    return values.ravel()


def _number(found: dict[str, Any], name: str, path: Path) -> float:
    values = _numbers(found, name, path)
    if values.size != 1:
        raise LogError(f"{path}: {name} has {values.size} values; one is needed")
    return float(values.ravel()[0])


def _log(path: Path, time: Array, position: Array, force: Array, *, rotary: bool) -> AxisLog:
    """The run, if its channels are of one length, finite, and its time increases."""
    if not len(time) == len(position) == len(force):
        raise LogError(
            f"{path}: {len(time)} times, {len(position)} positions, {len(force)} forces; "
            "as many of each are needed"
        )
    for name, values in (("time", time), ("position", position), ("force", force)):
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values)))
            raise LogError(f"{path}: {name}[{row}] is {values[row]}; a finite number is needed")
    if len(time) < 2 or not (np.diff(time) > 0.0).all():
        raise LogError(f"{path}: time does not increase strictly")
    return AxisLog(time=time, position=position, force=force, rotary=rotary, source=str(path))
