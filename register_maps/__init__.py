"""Register maps: which register of a PLC holds which signal. One TOML file describes one PLC.

`load` reads a map. `signals` has the signals, and `codec` turns words into values and back.
`parse.py` describes the keys of a map file.
"""

import hashlib
import re
import tomllib
from pathlib import Path

from register_maps import parse
from register_maps.entry import Lines
from register_maps.register_map import MapError, RegisterMap

__all__ = ["MapError", "RegisterMap", "load", "names"]

_HERE = Path(__file__).parent


def names() -> tuple[str, ...]:
    """Names of the shipped maps."""
    return tuple(sorted(path.stem for path in _HERE.glob("*.toml")))


def load(name_or_path: str | Path) -> RegisterMap:
    """Shipped map of this name, or the map in the file of this path. Raises MapError."""
    if not str(name_or_path).strip():
        raise _unreadable("''", 1, "an empty name", _expected())
    shipped = _HERE / f"{name_or_path}.toml"
    path = shipped if str(name_or_path) in names() else Path(name_or_path)
    content = _content(path)
    text = _text(path, content)
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also a number too long, or tables too deep
        at = re.search(r"line (\d+)", str(error))
        line = int(at[1]) if at else text.count("\n") + 1
        raise _unreadable(path, line, str(error), "TOML") from None
    digest = hashlib.sha256(content).hexdigest()
    return parse.parse(data, file=str(path), lines=Lines(text), source_hash=digest)


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except (OSError, ValueError) as error:  # a ValueError for a text that cannot be a name
        why = getattr(error, "strerror", None) or str(error)
        raise _unreadable(path, 1, why, _expected()) from None


def _text(path: Path, content: bytes) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise _unreadable(path, line, "not UTF-8", "TOML in UTF-8") from None


def _expected() -> str:
    return f"a readable file, or one of {', '.join(names())}"


def _unreadable(path: Path | str, line: int, why: str, expected: str) -> MapError:
    return MapError(file=str(path), line=line, place="file", value=why, expected=expected)
