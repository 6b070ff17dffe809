"""Reader and writer of an MDF4 log (ASAM MDF, version 4) in bytes: one channel a signal.

A channel has its unit. The time is the master of the groups, and the channels may be in several
groups with equal times. The package asammdf is loaded when the first such log is read or written;
it keeps what it writes in a temporary file of its own. No other file is opened here.
"""

import contextlib
import io
import struct
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from importlib import import_module
from math import nan
from typing import Any, Final, TypeVar

from register_maps.logs.log_table import (
    WITH_METADATA,
    Column,
    LogTable,
    LogTableError,
    table,
    with_metadata,
    without_package,
)

MAGIC: Final = b"MDF     4"
FIRST_BLOCK: Final = 64
BLOCK: Final = struct.Struct("<2s6xQQ")
"""Begin of a block: "##", its length, the count of the links after it; 0 is no link."""
MASTER: Final = (2, 3)
"""Types of a master channel: stored, and computed from the row."""
IN_SECONDS: Final = 1
"""Type of a master that holds the time."""
TIME: Final = with_metadata("time_s", "")
SAME_TIME: Final = 0.5e-4
"""[s] Times that differ by less count as equal, as in a CSV log."""
UNKNOWN_START: Final = datetime(1970, 1, 1, tzinfo=UTC)
"""Date of time zero for a log without a known date; a file must have one."""


Taken = TypeVar("Taken")


def recognises(head: bytes) -> bool:
    """Whether bytes with this begin are an MDF4 file."""
    return head.startswith(MAGIC)


def parse(data: bytes) -> LogTable:
    """Log in these bytes. Raises LogTableError."""
    return _open(data, _table)


def units(data: bytes) -> dict[str, str]:
    """Units of all columns by name, empty where there is none. Raises LogTableError.

    The master in seconds is the column `time`.
    """
    return _open(data, lambda file: {"time": "s"} | {n: u for n, (u, _) in _places(file).items()})


def values(data: bytes, names: Sequence[str]) -> list[list[float]]:
    """Values of these columns, all sampled at the same times. Raises LogTableError."""
    return _open(data, lambda file: _values(file, names))


def _open(data: bytes, take: Callable[[Any], Taken]) -> Taken:
    """Result of `take` on the open file. Raises LogTableError for a damaged one."""
    asammdf = _package()
    _check_blocks(data)
    failure = ""
    with _silent(asammdf):
        try:
            with asammdf.MDF(io.BytesIO(data)) as file:
                return take(file)
        except LogTableError:
            raise
        except Exception as error:  # noqa: BLE001 - a damaged file makes it fail in any way
            failure = " ".join(f"{type(error).__name__}: {error}".split())
    # Not `from error`, which would keep half-made objects of the package alive.
    raise LogTableError(f"damaged MDF4 file ({failure})")


def _check_blocks(data: bytes) -> None:
    """Refuse a cut or damaged file: a block is not where another block says."""
    seen, left = {0}, [FIRST_BLOCK]
    while left:
        start = left.pop()
        if start in seen:
            continue
        seen.add(start)
        if start + BLOCK.size > len(data):
            raise LogTableError(f"damaged MDF4 file (ends before its block at byte {start})")
        mark, length, links = BLOCK.unpack_from(data, start)
        if mark != b"##" or start + length > len(data) or BLOCK.size + 8 * links > length:
            raise LogTableError(f"damaged MDF4 file (no whole block at byte {start})")
        left += struct.unpack_from(f"<{links}Q", data, start + BLOCK.size)


def encode(columns: Sequence[Column], start: datetime = UNKNOWN_START, comment: str = "") -> bytes:
    """Return the columns as an MDF4 file; the column `time` [s] is the master.

    start : date at which that time is zero; comment : of the file
    """
    asammdf = _package()
    [time] = [column.values for column in columns if column.name == "time"]
    signals = [
        asammdf.Signal(
            samples=_samples(column.values),
            timestamps=time,
            name=column.name,
            unit=column.unit,
            encoding="utf-8",
        )
        for column in columns
        if column.name != "time"
    ]
    sink = io.BytesIO()
    with _silent(asammdf), asammdf.MDF(version="4.10") as file:
        file.start_time = start
        file.header.comment = comment
        file.append(signals)
        file.save(sink)
    return sink.getvalue()


def _samples(values: Any) -> Any:
    """Values of a column for MDF: texts as bytes, booleans as numbers."""
    if values.dtype.kind == "U":
        return values.astype("S")
    return values.astype("u1") if values.dtype.kind == "b" else values


def _package() -> Any:
    try:
        return import_module("asammdf")
    except ModuleNotFoundError:
        raise without_package("MDF4", "asammdf", "mdf4") from None


@contextlib.contextmanager
def _silent(asammdf: Any) -> Iterator[None]:
    """Keep the package from printing tracebacks for a damaged file."""
    logs, asammdf.logger.disabled = asammdf.logger.disabled, True
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        asammdf.logger.disabled, sys.unraisablehook = logs, hook


def _channels(file: Any) -> list[tuple[int, int]]:
    """Group and index of every channel that is no master."""
    return [
        (group, index)
        for group, content in enumerate(file.groups)
        for index, channel in enumerate(content.channels)
        if channel.channel_type not in MASTER
    ]


def _places(file: Any) -> dict[str, tuple[str, tuple[int, int]]]:
    """Unit and place of every channel by name; of channels with one name the first."""
    found: dict[str, tuple[str, tuple[int, int]]] = {}
    for group, index in _channels(file):
        channel = file.groups[group].channels[index]
        found.setdefault(channel.name, (_unit(channel), (group, index)))
    return found


def _values(file: Any, names: Sequence[str]) -> list[list[float]]:
    """Values of channels by name, of `time` their common time."""
    places = {name: place for name, (_, place) in _places(file).items()}
    groups = {places[name][0]: name for name in names if name != "time"}
    return [
        _time(file, groups) if name == "time" else _numbers(file, name, *places[name])
        for name in names
    ]


def _table(file: Any) -> LogTable:
    """Log in an open file."""
    places = _channels(file)
    names = [_name(file.groups[group].channels[index]) for group, index in places]
    groups = {
        group: name
        for (group, _), name in zip(places, names, strict=True)
        if name in WITH_METADATA and name != TIME
    }

    def numbers(k: int) -> list[float]:
        return _numbers(file, names[k - 1], *places[k - 1]) if k else _time(file, groups)

    return table([TIME, *names], numbers)


def _unit(channel: Any) -> str:
    return (channel.conversion and channel.conversion.unit) or channel.unit or ""


def _name(channel: Any) -> str:
    return with_metadata(channel.name, _unit(channel))


def _time(file: Any, groups: Mapping[int, str]) -> list[float]:
    """Common time of the groups [s]; groups : name of one column of each, for the error."""
    times = {name: _master(file, group, name) for group, name in groups.items()}
    (first, time), *others = times.items()
    for name, other in others:
        if len(other) != len(time) or bool((abs(other - time) >= SAME_TIME).any()):
            raise LogTableError(
                f"column {name}: was not sampled at the times of {first}; expected one time for all"
            )
    found: list[float] = time.tolist()
    return found


def _master(file: Any, group: int, name: str) -> Any:
    content = file.groups[group]
    masters = [c for c in content.channels if c.channel_type in MASTER]
    if not any(master.sync_type == IN_SECONDS for master in masters):
        raise LogTableError(f"column {name}: its group has no time; expected a master in seconds")
    _check_place(content, masters[0], TIME)
    return file.get_master(group).astype("f8")


def _check_place(group: Any, channel: Any, name: str) -> None:
    """Refuse a channel outside its records, where the package would read foreign memory."""
    end = 8 * channel.byte_offset + channel.bit_offset + channel.bit_count
    if end > 8 * group.channel_group.samples_byte_nr:
        raise LogTableError(f"damaged MDF4 file (column {name} lies outside its records)")


def _numbers(file: Any, name: str, group: int, index: int) -> list[float]:
    """Values of a channel, NaN where the file marks them as invalid."""
    _check_place(file.groups[group], file.groups[group].channels[index], name)
    # The default leaves invalid values out, which shifts all values after them.
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "fiu":
        raise LogTableError(f"column {name}: holds {signal.samples.dtype}; expected numbers")
    values = signal.samples.astype("f8")
    if signal.invalidation_bits is not None:
        values[signal.invalidation_bits.astype(bool)] = nan
    found: list[float] = values.tolist()
    return found
