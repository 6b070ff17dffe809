"""Files of drive programs: CSV with a time and a motor speed in each row.

    time_s,speed_rpm,dwell_s
    0,0,2
    5,1500,10
    8,0,0

The speed is linear between the rows. `time_s` begins at 0 and increases. `dwell_s` is optional: for
so long the speed of the row is held, which delays all later rows. The speed is `speed_rpm`, or
`speed_reference_rad_s` as in a log, so that the reference of a log can be driven again. A log may
have more columns; beside `speed_rpm`, an unknown column is refused as a mistake of writing.
"""

import csv
import gzip
import math
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from gateway.commissioning.drive import Point
from gateway.errors import ConfigError
from register_maps.units import RPM

TIME, DWELL = "time_s", "dwell_s"
SPEED_RPM: Final = "speed_rpm"
SPEEDS: Final = {SPEED_RPM: RPM, "speed_reference_rad_s": 1.0}
"""Column of the speed, and its factor to rad/s."""


def read(path: Path) -> list[Point]:
    """Points of the program in a file, time from 0. Raises ConfigError with file and line."""
    rows = csv.DictReader(_text(path).splitlines())
    header = rows.fieldnames or []
    speed = next((name for name in SPEEDS if name in header), None)
    if TIME not in header or speed is None:
        expected = f"columns {TIME} and {' or '.join(SPEEDS)}"
        raise ConfigError("no program", file=path, value=",".join(header), expected=expected)
    unknown = [name for name in header if name not in (TIME, SPEED_RPM, DWELL)]
    if speed == SPEED_RPM and unknown:
        expected = f"{TIME}, {SPEED_RPM} and, where speeds are held, {DWELL}"
        raise ConfigError("unknown column", file=path, value=unknown[0], expected=expected)
    points = [_point(path, rows.line_num, row, speed) for row in rows]
    start = points[0].time if points else 0.0
    return [Point(time=one.time - start, speed=one.speed, dwell=one.dwell) for one in points]


def _point(path: Path, line: int, row: Mapping[str | None, Any], speed: str) -> Point:
    if None in row:  # where the reader keeps cells beyond the header
        raise ConfigError(
            "more cells than columns", file=path, place=f"line {line}", value=row[None][0]
        )
    return Point(
        time=_number(path, line, TIME, row[TIME]),
        speed=SPEEDS[speed] * _number(path, line, speed, row[speed]),
        dwell=_dwell(path, line, row.get(DWELL)),
    )


def _text(path: Path) -> str:
    try:
        content = path.read_bytes()
        return (gzip.decompress(content) if path.suffix == ".gz" else content).decode("utf-8-sig")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise ConfigError(why, file=path, expected="a drive program (CSV)") from error


def _dwell(path: Path, line: int, text: str | None) -> float:
    value = _number(path, line, DWELL, text or "0")
    if value < 0.0:
        place = f"line {line}: {DWELL}"
        raise ConfigError("bad value", file=path, place=place, value=text, expected="0 or more")
    return value


def _number(path: Path, line: int, column: str, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        place = f"line {line}: {column}"
        raise ConfigError("bad value", file=path, place=place, value=text, expected="a number")
    return value
