"""Parameter sets as TOML files: the shipped ones beside this file, or a path of the user's."""

from __future__ import annotations

import tomllib
from pathlib import Path

from plant_emulator.errors import ParameterError
from plant_emulator.parameters import ParameterSet, parameter_set

FOLDER = Path(__file__).parent
DEFAULT = "thesis_table_3_1"


def names() -> list[str]:
    """Names of the shipped sets."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name: str = DEFAULT) -> ParameterSet:
    """The shipped set of that name, or the set in the TOML file of that path."""
    shipped = FOLDER / f"{name}.toml"
    path = shipped if name in names() else Path(name)
    if not path.is_file():
        raise ParameterError(
            f"{name}: no such parameter set; a file, or one of {', '.join(names())}"
        )
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path}: {error}") from error
    return parameter_set(name, table)
