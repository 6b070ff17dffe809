"""Reads one channel of a truck's road log: a CSV file, plain or gzip-compressed, with its time.

Columns `time_s` and `motor_torque_Nm` (load cell between the truck's motor and its gear, positive
forwards) or `velocity_m_s` (measuring wheel); others are passed over. Each file has the clock and
the rate of its own logger.
"""

from __future__ import annotations

import gzip
import hashlib
import math
import zlib
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from plant_emulator.log import Array

TIME, TORQUE, VELOCITY = "time_s", "motor_torque_Nm", "velocity_m_s"
ROLES = {TORQUE: "TORQUE", VELOCITY: "VELOCITY"}


def read(path: str, column: str) -> tuple[Array, Array]:
    """Time [s] and the column, shape (n,) each; LogError names file, line and column."""
    header, _, body = _text(path).partition("\n")
    names = [name.strip() for name in header.lstrip("\ufeff").split(",")]
    _check_header(path, names, column)
    places = [names.index(TIME), names.index(column)]
    lines = [line for line in body.splitlines() if line.strip()]
    try:
        if not lines or any(line.count(",") != len(names) - 1 for line in lines):
            raise _first_fault(path, names, places, body)
        table = np.loadtxt(lines, delimiter=",", ndmin=2, usecols=places, comments=None)
    except ValueError:
        raise _first_fault(path, names, places, body) from None
    if not (np.isfinite(table).all() and (np.diff(table[:, 0]) > 0.0).all()):
        raise _first_fault(path, names, places, body)
    return table[:, 0], table[:, 1]


def _text(path: str) -> str:
    try:
        data = Path(path).read_bytes()
        if data.startswith(b"\x1f\x8b"):
            data = gzip.decompress(data)
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise LogError(f"{path}: byte {error.start}: not UTF-8 text") from error
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise LogError(f"{path}: damaged gzip file ({error})") from error


def _check_header(path: str, names: list[str], column: str) -> None:
    other = next(name for name in ROLES if name != column)
    if column not in names and other in names:
        raise LogError(
            f"{path}: line 1: column {other}; the file given as {ROLES[column]} needs {column}, "
            "the order is TORQUE VELOCITY"
        )
    for needed in (TIME, column):
        if names.count(needed) != 1:
            found = "stands twice" if needed in names else "is missing; it is needed"
            raise LogError(f"{path}: line 1: column {needed} {found}, found {', '.join(names)}")


def _first_fault(path: str, names: list[str], places: list[int], body: str) -> LogError:
    """The first fault of the text, with line and column; found cell by cell."""
    last = -math.inf
    for number, line in enumerate(body.splitlines(), start=2):
        cells = line.split(",")
        if not line.strip():
            continue
        if len(cells) != len(names):
            return LogError(f"{path}: line {number}: {len(cells)} values; expected {len(names)}")
        for place in places:
            if not _finite(cells[place]):
                return LogError(
                    f"{path}: line {number}, column {names[place]}: {cells[place]!r}; expected a "
                    "finite number"
                )
        time = float(cells[places[0]])
        if time <= last:
            return LogError(
                f"{path}: line {number}, column {TIME}: {time:g} after {last:g}; time must "
                "increase strictly"
            )
        last = time
    return LogError(f"{path}: line 2: no sample")


def _finite(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def origin(*paths: str) -> list[str]:
    """Where a result comes from: date, version of the program, logs with their SHA-256."""
    logs = [
        f"{path}, SHA-256 {hashlib.sha256(Path(path).read_bytes()).hexdigest()}" for path in paths
    ]
    made = (
        f"{datetime.now(tz=UTC):%Y-%m-%d %H:%M} UTC, road-load-bench {version('road-load-bench')}"
    )
    return [f"plant-emulator identify-truck, {made}", *logs]
