"""CSV logs as the gateway replays them: `register_maps.csv_log` on a file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gateway.errors import ConfigError
from register_maps.csv_log import CsvLogError, parse
from register_maps.signals import LOG_COLUMNS

Column = np.ndarray[Any, np.dtype[np.float64]]


class LogError(ConfigError):
    """A log that may not be used: file, line, column, and what was expected."""


@dataclass(frozen=True, kw_only=True)
class Log:
    """A log in SI: `columns` by signal name, each as long as `time` [s]."""

    path: Path
    time: Column
    columns: dict[str, Column]

    def missing(self) -> list[str]:
        """Optional columns that are not there."""
        return [
            column.column
            for column in LOG_COLUMNS.values()
            if column.signal not in self.columns and column.signal != "time"
        ]


def read(path: Path) -> Log:
    """The log in a .csv or .csv.gz file."""
    try:
        found = parse(path.read_bytes())
    except CsvLogError as error:
        raise LogError(str(error), file=path) from error
    except OSError as error:
        raise LogError(
            error.strerror or "cannot be read", file=path, expected="a CSV log"
        ) from error
    columns = {signal: np.array(values) for signal, values in found.signals.items()}
    return Log(path=path, time=columns.pop("time"), columns=columns)
