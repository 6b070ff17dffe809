"""Reads and writes parameter sets: shipped TOML files beside this file, and files of the user."""

from __future__ import annotations

import json
import os
import tomllib
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plant_emulator.errors import ParameterError, report_unwritable
from plant_emulator.model.parameters import EFFECTS, FILE, ORIGIN, ParameterSet, parameter_set
from plant_emulator.model.sensors import SENSORS

if TYPE_CHECKING:
    from plant_emulator.model.parameters import Parameter

FOLDER = Path(__file__).parent
DEFAULT = "thesis_table_3_1"


def names() -> list[str]:
    """Names of the shipped sets."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name: str | Path = DEFAULT) -> ParameterSet:
    """Load the shipped set of that name, or the set in the TOML file of that path.

    Raises ParameterError with file and key for a set that cannot be used.
    """
    path, table = read(name)
    return with_files_from(path, parameter_set(str(name), table))


def read(name: str | Path) -> tuple[Path, dict[str, Any]]:
    """Path and tables of a set; ParameterError where there is no such file, or none in TOML."""
    shipped = FOLDER / f"{name}.toml"
    path = shipped if str(name) in names() else Path(name)
    if not path.is_file():
        raise ParameterError(
            f"{name}: no such parameter set; a file, or one of {', '.join(names())}"
        )
    try:
        return path, tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:  # no TOML or UTF-8, or a number too long
        raise ParameterError(f"{path}: {error}") from error


def with_files_from(path: Path, found: ParameterSet) -> ParameterSet:
    """The set of that path, which names the files of its effects from its own folder on."""
    files = {key: str(path.parent / file) for key, file in found.effect_files.items()}
    return replace(found, effect_files=files)


def save(parameters: ParameterSet, path: str | Path) -> None:
    """Write a set as a TOML file that `load` reads; InputError where it cannot be written."""
    with report_unwritable(path):
        folder = Path(path).absolute().parent
        files = {
            key: os.path.relpath(Path(file).absolute(), folder)
            for key, file in parameters.effect_files.items()
        }
        written = text(replace(parameters, effect_files=files))
        Path(path).write_text(written, encoding="utf-8")


def text(parameters: ParameterSet) -> str:
    """TOML text of a set: its origin, a table for each parameter, each effect and each sensor."""
    tables = [_table(p.name, _entries(p)) for p in parameters]
    if parameters.origin is not None:
        tables.insert(0, _table(ORIGIN, dict(parameters.origin)))
    files = {name: {FILE: file} for name, file in parameters.effect_files.items()}
    tables += [
        _table(f"{EFFECTS}.{name}", {**files.get(name, {}), **v})
        for name, v in parameters.effects.items()
    ]
    tables += [
        _table(f"{SENSORS}.{name}", dict(s.entries())) for name, s in parameters.sensors.items()
    ]
    return "\n".join(tables)


def _entries(parameter: Parameter) -> dict[str, object]:
    """Entries of the table of a parameter.

    A calculated value is left out, and so is an infinite error, which carries no information.
    """
    calculated = parameter.kind == "calculated"
    entries = {
        "symbol": parameter.symbol,
        "value": None if calculated else parameter.value,
        "unit": parameter.unit,
        "kind": parameter.kind,
        "std": parameter.std,
        "standard_error": parameter.standard_error,
        "source": parameter.source,
    }
    return {key: value for key, value in entries.items() if value not in (None, inf)}


def _table(name: str, entries: dict[str, object]) -> str:
    # JSON writes strings, numbers and lists of strings as TOML does.
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in entries.items()]
    return "\n".join([f"[{name}]", *lines, ""])
