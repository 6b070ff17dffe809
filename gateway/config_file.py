"""Read configuration files. An error names file and line."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gateway import regulators
from gateway.configuration.config import Config, Place, from_document, merge
from gateway.configuration.keys import check_text
from gateway.errors import ConfigError
from gateway.friction import friction_table


def load(path: str | Path) -> Config:
    """Configuration in a TOML file; a relative friction file is searched beside it.

    Raises ConfigError with file and line.
    """
    file = Path(path)
    text = _text(file)

    def place(section: str, key: str) -> str:
        return _place(file, text, section, key)

    document = _with_friction(_toml(file, text), file.parent, place)
    return _refuse_unknown_regulator(from_document(document, place=place), place)


def as_config(config: Config | str | Path) -> Config:
    """The configuration itself, or the configuration in the file of this path."""
    return config if isinstance(config, Config) else load(config)


def with_values(config: Config, values: Mapping[str, object]) -> Config:
    """Configuration with some values changed, `{"truck.load_kg": 1600}`; a text is read as TOML.

    `regulator.friction` may also be the path of a friction file. Raises ConfigError.
    """
    try:
        document = merge(config.document, values)
    except (ValueError, RecursionError) as error:
        raise ConfigError(_why(error), place="--set", expected="KEY=VALUE as in TOML") from error
    place = "{}.{}".format
    return _refuse_unknown_regulator(from_document(_with_friction(document, Path(), place)), place)


def load_friction(path: str | Path) -> dict[str, Any]:
    """Table of the friction in the file of a friction map or of a parameter set."""
    return friction_table(_toml(Path(path), _text(Path(path))), path)


def _refuse_unknown_regulator(config: Config, place: Place) -> Config:
    """Refuse a regulator that does not exist; otherwise return the configuration."""
    name = config.regulator.name
    if name not in regulators.names():
        raise regulators.unknown_error(name, place("regulator", "name"))
    return config


def _with_friction(document: dict[str, Any], directory: Path, place: Place) -> dict[str, Any]:
    regulator = document.get("regulator")
    if not isinstance(regulator, Mapping) or not isinstance(regulator.get("friction"), str):
        return document
    check_text(regulator["friction"], place("regulator", "friction"))
    table = load_friction(directory / regulator["friction"])
    return document | {"regulator": {**regulator, "friction": table}}


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
