"""One tick as bytes of fixed length: input, output, times (pure).

A record holds the raw words, so that a replay starts from exactly what the PLC sent. It also holds
the decoded values, so that a reader needs no register map. A missing value is NaN. A record ends
with the CRC-32 of the bytes before it, so that a torn record is recognised. Byte order is
little-endian, without padding.
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
"""Name, letter of struct, NumPy format. Times in seconds, demand in rad/s."""
SHADOW: Final = 1
STOP_REQUESTED: Final = 2
READ: Final = 4
WRITTEN: Final = 8
COMPUTED: Final = 16
NOTHING: Final = 0
"""Code of no fault and of no reason."""

MEASURED: Final = tuple(field.name for field in fields(Measurement))
COMMANDED: Final = tuple(field.name for field in fields(Setpoint))


@dataclass(frozen=True, kw_only=True)
class Tick:
    """The record of one tick of the loop.

    now, period : monotonic time of the reading, and time since the tick before [s]
    lateness : from deadline to wake-up [s]
    latency : from wake-up to the end of the write [s]
    age : of the newest sample [s]
    demand : of the regulator [rad/s]
    missed, overruns : deadlines missed so far, and in a row up to this tick
    dropped : records lost so far
    words_written, written : the encoded setpoint, and whether the PLC confirmed it
    problem : the link's own words for the fault of this tick; not recorded
    implausible : sums of the relations of motor, gear and drum over their alarm levels [1]; not
        recorded, because a replay computes them again
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
    problem: str = ""
    implausible: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def flags(self) -> int:
        """Flags of the tick in one byte."""
        return (
            SHADOW * self.shadow
            | STOP_REQUESTED * self.stop_requested
            | READ * (self.words_read is not None)
            | WRITTEN * self.written
            | COMPUTED * (self.words_written is not None)
        )


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Place of each value in a record, for blocks of these sizes."""

    read_count: int
    write_count: int

    @classmethod
    def of(cls, register_map: RegisterMap) -> "Layout":
        """Layout for the blocks of a register map."""
        return cls(
            read_count=register_map.measurement.count, write_count=register_map.command.count
        )

    @property
    def body(self) -> struct.Struct:
        """Structure of a record without its checksum."""
        return _body(self.read_count, self.write_count)

    @property
    def size(self) -> int:
        """Size of a record [bytes]."""
        return self.body.size + 4

    @property
    def formats(self) -> list[tuple[str, str, tuple[int, ...]]]:
        """Fields of a record as a NumPy structured type has them: name, format, shape."""
        return [
            *((name, code, ()) for name, _, code in HEAD),
            ("words_read", "<u2", (self.read_count,)),
            ("words_written", "<u2", (self.write_count,)),
            *((f"measured_{name}", "<f8", ()) for name in MEASURED),
            *((f"setpoint_{name}", "<f8", ()) for name in COMMANDED),
            ("crc", "<u4", ()),
        ]

    def pack(self, tick: Tick) -> bytes:
        """Return the record of one tick."""
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
    """Value in a record, in SI; NaN for None."""
    return math.nan if value is None else float(value)


def values(record: Measurement | Setpoint | None, names: Sequence[str]) -> list[float]:
    """Named fields of a block in a record, in SI; NaN where there is no block."""
    if record is None:
        return [math.nan] * len(names)
    return [number(getattr(record, name)) for name in names]


def is_intact(record: bytes) -> bool:
    """Whether the checksum of a record fits."""
    return zlib.crc32(record[:-4]) == int.from_bytes(record[-4:], "little")
