"""Log formats: modules with NAME, SUFFIXES, recognises(head), read(path) and write(log, path).

`read` finds the format by the first bytes of the file, `write` by the name of the file. A new
format is a new file in this folder. A module whose name begins with an underscore is not a format.
"""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from plant_emulator.errors import LogError, report_unwritable

if TYPE_CHECKING:
    from types import ModuleType

    from plant_emulator.signals.log import Log

HEAD = 4096


def formats() -> list[ModuleType]:
    """The format modules, by name."""
    found = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return [
        importlib.import_module(f"{__name__}.{name}") for name in found if not name.startswith("_")
    ]


def read(path: str | Path) -> Log:
    """Read the log in a file, SI; LogError names file, line, column and what would be right."""
    path = Path(path)
    if not path.is_file():
        raise LogError(f"{path}: no such file; a log file is needed")
    with path.open("rb") as file:
        head = file.read(HEAD)
    for module in formats():
        if module.recognises(head):
            log: Log = module.read(path)
            return log
    names = ", ".join(module.NAME for module in formats())
    raise LogError(f"{path}: not a log in a known format; known: {names}")


def write(log: Log, path: str | Path) -> None:
    """Write a log in the format of the file's suffix.

    Raises LogError for an unknown suffix, and InputError for a file that cannot be written.
    """
    path = Path(path)
    for module in formats():
        if path.name.endswith(module.SUFFIXES):
            with report_unwritable(path):
                module.write(log, path)
            return
    known = ", ".join(suffix for module in formats() for suffix in module.SUFFIXES)
    raise LogError(f"{path}: no log format of that name; known: {known}")


def rehearse(log: Log, path: str | Path) -> None:
    """Raise LogError if a log could not be written at `path`; the log is written elsewhere.

    A log at the end of a long run calls for this check at the start of the run.
    """
    with TemporaryDirectory() as folder:
        trial = Path(folder) / Path(path).name
        try:
            write(log, trial)
        except LogError as error:
            raise LogError(str(error).replace(str(trial), str(path))) from error
