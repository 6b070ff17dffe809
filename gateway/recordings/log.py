"""Logs as the gateway replays them, read by the readers of `register_maps`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gateway.arrays import Array
from gateway.errors import ConfigError
from register_maps.logs import csv_log, mdf4_log, parquet_log
from register_maps.logs.log_table import LogTableError, check_sampling
from register_maps.signals import LOG_COLUMNS

NO_SENSORS: Final = ("time", "truck_on_drum")
"""Columns of no sensor, beside the knees of the reference."""


class LogError(ConfigError):
    """A log that cannot be used: file, line, column, and what was expected."""


@dataclass(frozen=True, kw_only=True)
class Log:
    """A log in SI; columns : by signal name, each as long as `time` [s]."""

    path: Path
    time: Array
    columns: dict[str, Array]

    def missing_columns(self) -> list[str]:
        """Names of the optional columns of sensors that the log lacks."""
        return [
            column.column
            for column in LOG_COLUMNS.values()
            if column.signal not in self.columns
            and column.signal not in NO_SENSORS
            and not column.signal.startswith("reference_knee")
        ]


def read(path: Path) -> Log:
    """Log in a CSV, Parquet or MDF4 file; its content shows the format. Raises LogError."""
    try:
        data = path.read_bytes()
        binary = (form for form in (parquet_log, mdf4_log) if form.recognises(data))
        found = next(binary, csv_log).parse(data)
        check_sampling(found.signals["time"])
    except LogTableError as error:
        raise LogError(str(error), file=path) from error
    except OSError as error:
        raise LogError(error.strerror or "cannot be read", file=path, expected="a log") from error
    columns = {signal: np.array(values) for signal, values in found.signals.items()}
    return Log(path=path, time=columns.pop("time"), columns=columns)
