"""Parquet and MDF4 files as tables; their columns have units as metadata."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.workflows.axis_files.table import Table
from register_maps.logs import mdf4_log, parquet_log
from register_maps.logs.log_table import LogTableError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array


def table(data: bytes, path: str) -> Table:
    """The table of a Parquet or MDF4 file in these bytes; raises LogError."""
    reader = mdf4_log if mdf4_log.recognises(data) else parquet_log

    def take(wanted: Sequence[str]) -> list[Array]:
        try:
            found = reader.values(data, wanted)
        except LogTableError as error:
            raise LogError(f"{path}: {error}") from error
        return [np.array(values, dtype=np.float64) for values in found]

    try:
        units = reader.units(data)
    except LogTableError as error:
        raise LogError(f"{path}: {error}") from error
    return Table(
        path=path,
        header="columns",
        names=tuple(units),
        units={name: unit for name, unit in units.items() if unit},
        take=take,
        row=lambda row: f"row {row + 1}",
    )
