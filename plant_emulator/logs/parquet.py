"""Reads and writes Parquet logs; `register_maps.logs.parquet_log` defines the format."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.logs import _files
from register_maps.logs import parquet_log

if TYPE_CHECKING:
    from pathlib import Path

    from plant_emulator.signals.log import Log

NAME = "Parquet"
SUFFIXES = (".parquet",)


def recognises(head: bytes) -> bool:
    """Whether a file that begins with these bytes is a Parquet file."""
    return parquet_log.recognises(head)


def read(path: Path) -> Log:
    """Read the log of a Parquet file, SI; LogError names file, row and column."""
    return _files.read(path, parquet_log.parse)


def write(log: Log, path: Path) -> None:
    """Write a log as Parquet."""
    _files.write(log, path, parquet_log.encode)
