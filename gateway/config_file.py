"""Read configuration files. An error names file and line."""

import re
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from gateway import regulators
from gateway.configuration.config import Config, Place, from_document, merge
from gateway.configuration.keys import check_text
from gateway.configuration.memory import read_memory
from gateway.errors import ConfigError
from gateway.friction.document import read_friction, regulator_entries


def load(path: str | Path) -> Config:
    """Configuration in a TOML file; relative files of friction and memory are searched beside it.

    Raises ConfigError with file and line.
    """
    file = Path(path)
    text = _text(file)

    def place(section: str, key: str) -> str:
        return _place(file, text, section, key)

    written = _toml(file, text)
    document = _with_friction(written, file.parent, place, _keys_of(written.get("regulator")))
    document = _with_memory(document, file.parent, place)
    return _refuse_unknown_regulator(from_document(document, place=place), place)


def as_config(config: Config | str | Path) -> Config:
    """The configuration itself, or the configuration in the file of this path."""
    return config if isinstance(config, Config) else load(config)


def with_values(config: Config, values: Mapping[str, object]) -> Config:
    """Configuration with some values changed, `{"truck.load_kg": 1600}`; a text is read as TOML.

    `regulator.friction` may also be the path of a friction file; what that tells of the torque
    sensor holds unless the values name it. `regulator.learned` may be a path, too. Raises
    ConfigError.
    """
    try:
        document = merge(config.document, values)
    except (ValueError, RecursionError) as error:
        raise ConfigError(_why(error), place="--set", expected="KEY=VALUE as in TOML") from error
    place = "{}.{}".format
    named = {name.removeprefix("regulator.") for name in values}
    whole = _with_memory(_with_friction(document, Path(), place, named), Path(), place)
    return _refuse_unknown_regulator(from_document(whole), place)


def load_friction(path: str | Path) -> dict[str, Any]:
    """Entries of [regulator] in the file of a friction map or of a parameter set."""
    found = regulator_entries(_toml(Path(path), _text(Path(path))), path)
    read_friction(found["friction"], f"{path}: friction")  # whose error names the file
    return found


def _refuse_unknown_regulator(config: Config, place: Place) -> Config:
    """Refuse a regulator that does not exist; otherwise return the configuration."""
    name = config.regulator.name
    if name not in regulators.names():
        raise regulators.unknown_error(name, place("regulator", "name"))
    return config


def _keys_of(table: object) -> Collection[str]:
    return table.keys() if isinstance(table, Mapping) else ()


def _with_friction(
    document: dict[str, Any], directory: Path, place: Place, named: Collection[str]
) -> dict[str, Any]:
    """Document with the content of its friction file, which no `named` key gives way to."""
    regulator = document.get("regulator")
    if not isinstance(regulator, Mapping) or not isinstance(regulator.get("friction"), str):
        return document
    check_text(regulator["friction"], place("regulator", "friction"))
    found = load_friction(directory / regulator["friction"])
    told = {key: one for key, one in found.items() if key == "friction" or key not in named}
    return document | {"regulator": {**regulator, **told}}


def _with_memory(document: dict[str, Any], directory: Path, place: Place) -> dict[str, Any]:
    """Document with the content of the file that the learned regulator remembers by."""
    regulator = document.get("regulator")
    if not isinstance(regulator, Mapping) or not isinstance(regulator.get("learned"), str):
        return document
    check_text(regulator["learned"], place("regulator", "learned"))
    path = directory / regulator["learned"]
    found = _toml(path, _text(path))
    read_memory(found, f"{path}: memory")  # whose error names the file
    return document | {"regulator": {**regulator, "learned": found}}


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise ConfigError(why, file=path, expected="a TOML file that can be read") from error


def _toml(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(_why(error), file=path, expected="TOML") from error


def _why(error: ValueError | RecursionError) -> str:
    """Message of the TOML reader; plain words where the reader names Python instead of TOML."""
    match error:
        case tomllib.TOMLDecodeError():
            return str(error)
        case RecursionError():
            return "arrays or tables nested too deep"
    return "a number of too many digits"


def _place(path: Path, text: str, section: str, key: str) -> str:
    """`file:line: [section] key`, without the line where the file does not have the key."""
    inside = ""
    for number, line in enumerate(text.splitlines(), 1):
        heading = re.match(r"\s*\[\s*([\w.-]+)\s*\]", line)
        inside = heading[1] if heading else inside
        wanted = inside == section and (
            bool(heading) if not key else re.match(rf"\s*\"?{re.escape(key)}\"?\s*[=.]", line)
        )
        if wanted:
            return f"{path}:{number}: [{section}] {key}".rstrip()
    return f"{path}: [{section}] {key}".rstrip()
