"""Reads and writes MDF4 logs; `register_maps.logs.mdf4_log` defines the format."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.logs import _files
from register_maps.logs import mdf4_log

if TYPE_CHECKING:
    from pathlib import Path

    from plant_emulator.signals.log import Log

NAME = "MDF4"
SUFFIXES = (".mf4",)


def recognises(head: bytes) -> bool:
    """Whether a file that begins with these bytes is an MDF4 file."""
    return mdf4_log.recognises(head)


def read(path: Path) -> Log:
    """Read the log of an MDF4 file, SI; LogError names file, row and column."""
    return _files.read(path, mdf4_log.parse)


def write(log: Log, path: Path) -> None:
    """Write a log as MDF4."""
    _files.write(log, path, mdf4_log.encode)
