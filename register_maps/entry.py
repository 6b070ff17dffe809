"""One table of a map file, read key by key. An error names file and line.

`tomllib` gives values without lines, so that `Lines` finds the line of each table header and each
key in the text.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from register_maps.register_map import MapError

_HEADER = re.compile(r"\s*\[+\s*([A-Za-z0-9_.-]+)\s*\]+")
_KEY = re.compile(r"\s*[\"']?([A-Za-z0-9_-]+)[\"']?\s*[.=]")
_QUOTES = re.compile(r'"""|' + "'''")


class Lines:
    """Lines of tables and keys; `of("register", 3, "unit")` for the third `[[register]]`."""

    def __init__(self, text: str) -> None:
        self._found: dict[tuple[str, int, str | None], int] = {}
        table, count, quoted = "", {"": 1}, False
        for number, line in enumerate(text.splitlines(), start=1):
            if not quoted and (header := _HEADER.match(line)):
                table = header[1]
                count[table] = count.get(table, 0) + 1
                self._found[table, count[table], None] = number
            elif not quoted and (key := _KEY.match(line)):
                self._found.setdefault((table, count[table], key[1]), number)
            quoted ^= len(_QUOTES.findall(line)) % 2 == 1

    def of(self, table: str, index: int, key: str | None) -> int:
        """Line of the key, otherwise of its table, otherwise of the place where it should be."""
        wanted = (
            (table, index, key),
            (key or table, 1, None) if table == "" else (table, index, None),
            ("", 1, table),
            (table, 1, None),
        )
        return next((self._found[place] for place in wanted if place in self._found), 1)


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One table of the file: its values, and the error for one of them.

    Each reading method raises MapError.
    """

    values: Mapping[str, Any]
    table: str
    index: int
    file: str
    lines: Lines

    def error(self, key: str | None, expected: str) -> MapError:
        """Error for this key, or for the whole table."""
        name = self.values.get("name")
        unnamed = f"{self.table} {self.index}" if self.table else "file"
        shown = name if isinstance(name, str) and name else unnamed
        value = self.values.get(key, "missing") if key else shown
        return MapError(
            file=self.file,
            line=self.lines.of(self.table, self.index, key),
            place=f"{shown}.{key}" if key else self.table,
            value=value,
            expected=expected,
        )

    def refuse_unknown(self, keys: frozenset[str]) -> None:
        """Refuse unknown keys."""
        for key in self.values:
            if key not in keys:
                raise self.error(key, f"a known key: {', '.join(sorted(keys))}")

    def text(self, key: str) -> str:
        """A text that is not empty, on one line."""
        value = self.values.get(key)
        if not isinstance(value, str) or not value.strip() or "\n" in value:
            raise self.error(key, "a text that is not empty, on one line")
        return value

    def choice(self, key: str, allowed: tuple[str, ...], default: str | None = None) -> Any:
        """One of the allowed words."""
        value = self.values.get(key, default)
        if value not in allowed:
            raise self.error(key, f"one of {', '.join(allowed)}")
        return value

    def integer(self, key: str, low: int, high: int) -> int:
        """A whole number, low .. high."""
        value = self.values.get(key)
        if type(value) is not int or not low <= value <= high:
            raise self.error(key, f"a whole number {low} .. {high}")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number."""
        value = self.values.get(key, default)
        if not is_number(value):
            raise self.error(key, "a finite number")
        return float(value)

    def flag(self, key: str) -> bool:
        """True or false; false where the key is absent."""
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise self.error(key, "true or false")
        return value

    def pair(self, key: str) -> tuple[float, float]:
        """Two finite numbers, the lower one first."""
        match self.values.get(key):
            case [low, high] if is_number(low) and is_number(high) and low <= high:
                return float(low), float(high)
        raise self.error(key, "[lowest, highest], two finite numbers")


def is_number(value: object) -> bool:
    """Whether a value is a finite number that a float can hold, and not a boolean."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return abs(value) < 1e300 and math.isfinite(value)
