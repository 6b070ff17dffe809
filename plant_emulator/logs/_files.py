"""Code that the formats share: from bytes to a log, and from a log to columns with units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.signals.log import Array, Log
from register_maps.logs.log_table import Column, LogTable, LogTableError, check_sampling
from register_maps.signals import LOG_COLUMNS, LogColumn
from register_maps.units import UNITS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path


def read(path: Path, parse: Callable[[bytes], LogTable]) -> Log:
    """Read the log in a file, SI; LogError names file, place and column."""
    try:
        found = parse(path.read_bytes())
        check_sampling(found.signals["time"])
    except LogTableError as error:
        raise LogError(f"{path}: {error}") from error
    signals = {signal: np.array(values) for signal, values in found.signals.items()}
    return Log(signals.pop("time"), signals, str(path), found.other)


def write(log: Log, path: Path, encode: Callable[[Sequence[Column]], bytes]) -> None:
    """Write the signals with their names and units, in full precision.

    Raises LogError where the format cannot hold the log.
    """
    columns = [
        Column(name=column.signal, unit=column.unit, values=values)
        for column, values in in_units(log)
    ]
    try:
        path.write_bytes(encode(columns))
    except LogTableError as error:
        raise LogError(f"{path}: {error}") from error


def in_units(log: Log) -> list[tuple[LogColumn, Array]]:
    """Columns that a log fills, each with its values in the unit of the column."""
    signals = {"time": log.time, **log.signals}
    return [
        (column, (signals[column.signal] - UNITS[column.unit].shift) / UNITS[column.unit].factor)
        for column in LOG_COLUMNS.values()
        if column.signal in signals
    ]
