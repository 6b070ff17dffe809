"""Parquet logs on disk; what one may hold is told in `register_maps.parquet_log`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.logs import _files
from register_maps import parquet_log

if TYPE_CHECKING:
    from pathlib import Path

    from plant_emulator.signals.log import Log

NAME = "Parquet"
SUFFIXES = (".parquet",)


def recognises(head: bytes) -> bool:
    """Whether a file that begins with these bytes is a Parquet file."""
    return parquet_log.recognises(head)


def read(path: Path) -> Log:
    """The log of a Parquet file; LogError names file, row and column."""
    return _files.read(path, parquet_log.parse)


def write(log: Log, path: Path) -> None:
    """Write a log."""
    _files.write(log, path, parquet_log.encode)
