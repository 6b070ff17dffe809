"""The alarms of a daemon: what has ended its runs, since when, how often, and acknowledged or not.

The operator acknowledges at the PLC: remote off and on in SAFE. That acknowledges every alarm so
far; the next one of the same reason is new (pure).
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

ALARM: Final = struct.Struct("<Qdd")
"""Count, and the times of the first and the last [s]."""


@dataclass(frozen=True, kw_only=True)
class Alarm:
    """Trips of one reason: code, count, monotonic times of the first and the last [s]."""

    reason: int
    count: int
    first: float
    last: float
    acknowledged: bool


def note(buffer: Any, start: int, now: float) -> None:
    """Note one more alarm of the reason whose entry stands at `start`; now [s]."""
    count, first, _ = ALARM.unpack_from(buffer, start)
    ALARM.pack_into(buffer, start, count + 1, first if count else now, now)


def decode(content: bytes, start: int, codes: Sequence[int], acknowledged: float) -> list[Alarm]:
    """The alarms that there were, oldest first; acknowledged : time of the operator's last one [s].

    The entries of these codes stand one behind the other from `start` on.
    """
    entries = (ALARM.unpack_from(content, start + k * ALARM.size) for k in range(len(codes)))
    found = [
        Alarm(reason=code, count=count, first=first, last=last, acknowledged=last <= acknowledged)
        for code, (count, first, last) in zip(codes, entries, strict=True)
        if count
    ]
    return sorted(found, key=lambda alarm: alarm.first)
