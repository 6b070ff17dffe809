"""Keys of a configuration file: each is declared beside its field, which also checks the value."""

import math
import re
from dataclasses import dataclass, field, fields
from typing import Any, Final

from gateway.errors import ConfigError

CONTROL: Final = re.compile(r"[\x00-\x1f\x7f]")
"""Characters that no text on one line has."""


@dataclass(frozen=True, kw_only=True)
class Key:
    """One key of the file. Value in SI = value in the file * scale; the range is in file units."""

    name: str
    default: Any
    scale: float
    lower: float
    upper: float
    choices: tuple[str, ...]


def declare(
    name: str,
    default: Any,
    *,
    scale: float = 1.0,
    lower: float = -math.inf,
    upper: float = math.inf,
    choices: tuple[str, ...] = (),
) -> Any:
    """Declare the field of a section with its key."""
    found = Key(name=name, default=default, scale=scale, lower=lower, upper=upper, choices=choices)
    return field(default=si(found, default), metadata={"key": found})


def si(key: Key, value: Any) -> Any:
    """Value in SI of a value in the file; whole numbers and texts have no unit."""
    return value * key.scale if isinstance(value, float) else value


def keys(section: type) -> dict[str, Key]:
    """Keys of a section by the name of their field."""
    return {one.name: one.metadata["key"] for one in fields(section) if "key" in one.metadata}


def read_value(key: Key, kind: Any, value: Any, where: str) -> Any:
    """Value in SI of a value in the file. Raises ConfigError with place and allowed values."""
    wanted = next((one for one in (str, bool, int) if kind in (one, one | None)), float)
    numeric = wanted is float and isinstance(value, int) and not isinstance(value, bool)
    if type(value) is not wanted and not numeric:
        name = {str: "text", bool: "true or false", int: "a whole number", float: "a number"}
        raise ConfigError("wrong type", place=where, value=value, expected=name[wanted])
    if wanted is str:
        check_text(value, where)
    if key.choices and value not in key.choices:
        raise ConfigError(
            "unknown choice", place=where, value=value, expected=" or ".join(key.choices)
        )
    if wanted in (int, float) and not key.lower <= value <= key.upper:
        expected = f"{key.lower:g} .. {key.upper:g}"
        raise ConfigError("out of range", place=where, value=value, expected=expected)
    return si(key, float(value) if numeric else value)


def check_text(value: str, where: str) -> None:
    """Refuse an empty text and a text with control characters."""
    if not value.strip() or CONTROL.search(value):
        what = "control character" if value.strip() else "empty"
        raise ConfigError(what, place=where, value=value, expected="a text on one line")
