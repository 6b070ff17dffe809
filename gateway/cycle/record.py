"""One tick as bytes of fixed length: what came in, what went out, when (pure).

A record holds the raw words, so that a replay starts from exactly what the PLC said, and beside
them the decoded values, so that a reader needs no register map. A value that was not there is a
NaN; a record ends with the CRC-32 of what stands before it, so that a torn one is recognised.
Little-endian, no padding.
"""

import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Final

from register_maps.register_map import RegisterMap
from register_maps.signals import Measurement, Setpoint

MAGIC: Final = b"RLREC\x01\r\n"
HEAD: Final = (
    ("tick", "Q", "<u8"),
    ("now", "d", "<f8"),
    ("period", "d", "<f8"),
    ("lateness", "d", "<f8"),
    ("latency", "d", "<f8"),
    ("age", "d", "<f8"),
    ("demand", "d", "<f8"),
    ("missed", "I", "<u4"),
    ("overruns", "I", "<u4"),
    ("dropped", "I", "<u4"),
    ("fault", "H", "<u2"),
    ("reason", "H", "<u2"),
    ("state", "B", "u1"),
    ("flags", "B", "u1"),
)
"""Name, letter of struct, numpy format. Times in seconds, demand in rad/s."""
SHADOW: Final = 1
STOP_REQUESTED: Final = 2
READ: Final = 4
WRITTEN: Final = 8
COMPUTED: Final = 16
NOTHING: Final = 0
"""Code of a fault or reason that is not there."""

MEASURED: Final = tuple(field.name for field in fields(Measurement))
COMMANDED: Final = tuple(field.name for field in fields(Setpoint))


@dataclass(frozen=True, kw_only=True)
class Tick:
    """What one tick of the loop did.

    now : monotonic time of the reading [s]; period : since the tick before [s]
    lateness : wake-up after the deadline [s]; latency : from wake-up to end of write [s]
    age : of the newest sample [s]; demand : of the regulator [rad/s]
    missed : deadlines so far; overruns : in a row, up to this tick
    words_written : what the limits passed; `written` says whether the PLC confirmed it
    """

    tick: int
    now: float
    period: float
    lateness: float
    latency: float
    age: float | None
    demand: float | None
    missed: int
    overruns: int
    dropped: int
    fault: int
    reason: int
    state: int
    shadow: bool
    stop_requested: bool
    written: bool
    words_read: Sequence[int] | None
    words_written: Sequence[int] | None
    measurement: Measurement | None
    setpoint: Setpoint | None

    @property
    def flags(self) -> int:
        """The yes-or-no facts in one byte."""
        return (
            SHADOW * self.shadow
            | STOP_REQUESTED * self.stop_requested
            | READ * (self.words_read is not None)
            | WRITTEN * self.written
            | COMPUTED * (self.words_written is not None)
        )


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where each value of a record lies, for blocks of these sizes."""

    read_count: int
    write_count: int

    @classmethod
    def of(cls, register_map: RegisterMap) -> "Layout":
        """The layout for a register map."""
        return cls(
            read_count=register_map.measurement.count, write_count=register_map.command.count
        )

    @property
    def body(self) -> struct.Struct:
        """All but the checksum."""
        return _body(self.read_count, self.write_count)

    @property
    def size(self) -> int:
        """Bytes of a record."""
        return self.body.size + 4

    @property
    def formats(self) -> list[tuple[str, str, tuple[int, ...]]]:
        """The same as a numpy structured dtype: name, format, shape."""
        return [
            *((name, code, ()) for name, _, code in HEAD),
            ("words_read", "<u2", (self.read_count,)),
            ("words_written", "<u2", (self.write_count,)),
            *((f"measured_{name}", "<f8", ()) for name in MEASURED),
            *((f"setpoint_{name}", "<f8", ()) for name in COMMANDED),
            ("crc", "<u4", ()),
        ]

    def pack(self, tick: Tick) -> bytes:
        """The record of one tick."""
        body = self.body.pack(
            tick.tick,
            tick.now,
            tick.period,
            tick.lateness,
            tick.latency,
            number(tick.age),
            number(tick.demand),
            tick.missed,
            tick.overruns,
            tick.dropped,
            tick.fault,
            tick.reason,
            tick.state,
            tick.flags,
            *(tick.words_read or (0,) * self.read_count),
            *(tick.words_written or (0,) * self.write_count),
            *values(tick.measurement, MEASURED),
            *values(tick.setpoint, COMMANDED),
        )
        return body + zlib.crc32(body).to_bytes(4, "little")


@lru_cache
def _body(read_count: int, write_count: int) -> struct.Struct:
    letters = "".join(letter for _, letter, _ in HEAD)
    words = f"{read_count}H{write_count}H"
    return struct.Struct(f"<{letters}{words}{len(MEASURED)}d{len(COMMANDED)}d")


def number(value: float | None) -> float:
    """A value as a record holds it: NaN where there is none."""
    return math.nan if value is None else float(value)


def values(record: Measurement | Setpoint | None, names: Sequence[str]) -> list[float]:
    """The named fields as a record holds them."""
    if record is None:
        return [math.nan] * len(names)
    return [number(getattr(record, name)) for name in names]


def is_intact(record: bytes) -> bool:
    """Whether a record is whole: its checksum fits."""
    return zlib.crc32(record[:-4]) == int.from_bytes(record[-4:], "little")
