"""Reads one channel of a truck's road log: a CSV file with its time, plain or gzip-compressed.

The columns are `time_s` and `motor_torque_Nm` (load cell between motor and gear, positive forwards)
or `velocity_m_s` (measuring wheel). Other columns are ignored. Each file has the clock and the
sample rate of its own logger.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.workflows.provenance import file_hash, program_version
from register_maps.logs.csv_log import TIME, CsvLogError, parse
from register_maps.signals import LOG_COLUMNS, LogColumn

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


def channel(column: str, signal: str, unit: str) -> LogColumn:
    """Declaration of a column. `read` checks whether the file has it, because it knows the role."""
    return LogColumn(
        column=column, signal=signal, unit=unit, needed=False, measured=None, decimals=4
    )


TORQUE = channel("motor_torque_Nm", "motor_torque", "N m")
VELOCITY = channel("velocity_m_s", "velocity", "m/s")
ROLES = {TORQUE.column: "TORQUE", VELOCITY.column: "VELOCITY"}


def read(path: str, wanted: LogColumn) -> tuple[Array, Array]:
    """Read time [s] and one channel [SI], shape (n,) each.

    wanted : TORQUE or VELOCITY
    Raises LogError with file, line and column.
    """
    if not Path(path).is_file():
        raise LogError(f"{path}: no such file; a log of a road is needed")
    try:
        columns = {TIME: LOG_COLUMNS[TIME], wanted.column: wanted}
        found = parse(Path(path).read_bytes(), columns)
    except CsvLogError as error:
        raise LogError(f"{path}: {error}") from error
    if wanted.signal not in found.signals:
        swapped = next((name for name in found.other if name in ROLES), None)
        hint = f", found {swapped}: the order is TORQUE VELOCITY" if swapped else ""
        raise LogError(
            f"{path}: line 1: column {wanted.column} is missing; the file given as "
            f"{ROLES[wanted.column]} needs it{hint}"
        )
    return np.array(found.signals["time"]), np.array(found.signals[wanted.signal])


def origin(*paths: str) -> list[str]:
    """Origin of a result: date, version of the program, and the logs with their SHA-256."""
    logs = [f"{path}, SHA-256 {file_hash(path)}" for path in paths]
    made = f"{datetime.now(tz=UTC):%Y-%m-%d %H:%M} UTC, road-load-bench {program_version()}"
    return [f"plant-emulator identify-truck, {made}", *logs]
