"""Provenance of a result: the date, the version of the program, and the hashes of the files."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from plant_emulator.signals.log import Log


def today() -> str:
    """Today's date in UTC, as in ISO 8601."""
    return datetime.now(UTC).date().isoformat()


def program_version() -> str:
    """Version of the installed program."""
    return version("road-load-bench")


def log_hash(source: str | Path | Log) -> str:
    """SHA-256 of a log file, or of the samples of a log, in hexadecimal digits."""
    if not isinstance(source, Log):
        return file_hash(source)
    found = hashlib.sha256(source.time.tobytes())
    for name, values in source.signals.items():
        found.update(name.encode() + values.tobytes())
    return found.hexdigest()


def file_hash(path: str | Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()
