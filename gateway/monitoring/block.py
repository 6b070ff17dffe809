"""The status block: a few kilobytes that one process writes every tick and others read (pure).

A sequence counter guards the block (a seqlock). It is odd while the writer changes the block. A
reader copies the block and keeps the copy only if the counter was even and equal before and after.
So the writer never waits, whatever its readers do. Processors that keep the order of stores
(x86-64) need nothing more.

Counters grow in place; the newest values are packed anew in every tick. The last changes of state
and reason stand in a ring.
"""

import math
import struct
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

from gateway.cycle.record import NOTHING, Tick, number
from gateway.cycle.supervisor import State
from gateway.monitoring import alarms
from gateway.monitoring.alarms import ALARM, Alarm
from gateway.reasons import BY_OPERATOR, Reason

BOUNDS: Final = (
    *(1e-4, 2e-4, 3e-4, 5e-4, 7e-4, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 7e-3),
    *(1e-2, 1.5e-2, 2e-2, 3e-2, 5e-2, 0.1, 0.2, math.inf),
)
"""Upper bounds of the bins of both histograms [s]."""
CODES: Final = (NOTHING, *map(int, Reason))
"""Code of each counter of reasons."""
RING: Final = 64
"""Changes that the block keeps."""
COUNTER: Final = 8
"""[bytes] Every counter is a 64-bit number."""
SEQUENCE: Final = struct.Struct("<Q")
CHANGE: Final = struct.Struct("<QdQQQ")
PLACE: Final = {code: index for index, code in enumerate(CODES)}


@dataclass(frozen=True, kw_only=True)
class Values:
    """Values of the newest tick, in the order in which the block keeps them; NaN: not there.

    now, since : monotonic time of the tick, and of the last change of state [s]
    ticks, lost, missed, overruns, dropped : ticks so far; polls without a good image; deadlines
        missed, and missed in a row; records that the recorder did not get
    images, runs, trips : good images; entries into RUN; ends of a run that no operator asked for
    changes : of state or reason so far
    acknowledged : monotonic time of the operator's last acknowledgement [s], 0: there was none
    state, reason, fault : codes as in a recording
    age, latency, lateness : of the newest sample, of the tick [s]
    latency_sum, latency_max, lateness_sum, lateness_max : over all ticks [s]
    demand, setpoint, motor_speed, drum_speed [rad/s]; shaft_torque [N m]; armature_current [A]
    motor_share, gear_share, drum_share : sums of the plausibility over their alarm levels [1]
    problem : the link's own words for its last fault, without which there is no connection
    """

    now: float = 0.0
    since: float = 0.0
    ticks: int = 0
    lost: int = 0
    missed: int = 0
    overruns: int = 0
    dropped: int = 0
    images: int = 0
    runs: int = 0
    trips: int = 0
    changes: int = 0
    acknowledged: float = 0.0
    state: int = 0
    reason: int = NOTHING
    fault: int = NOTHING
    shadow: bool = False
    age: float = math.nan
    latency: float = 0.0
    lateness: float = 0.0
    latency_sum: float = 0.0
    latency_max: float = 0.0
    lateness_sum: float = 0.0
    lateness_max: float = 0.0
    demand: float = math.nan
    setpoint: float = math.nan
    motor_speed: float = math.nan
    drum_speed: float = math.nan
    shaft_torque: float = math.nan
    armature_current: float = math.nan
    motor_share: float = 0.0
    gear_share: float = 0.0
    drum_share: float = 0.0
    problem: bytes = b""


LETTERS: Final[dict[Any, str]] = {float: "d", int: "Q", bool: "?", bytes: "160s"}
VALUES: Final = struct.Struct("<" + "".join(LETTERS[one.type] for one in fields(Values)))
AT_VALUES: Final = SEQUENCE.size
AT_LATENCY: Final = -(-(AT_VALUES + VALUES.size) // COUNTER) * COUNTER
AT_LATENESS: Final = AT_LATENCY + len(BOUNDS) * COUNTER
AT_REASONS: Final = AT_LATENESS + len(BOUNDS) * COUNTER
AT_FAULTS: Final = AT_REASONS + len(CODES) * COUNTER
AT_ALARMS: Final = AT_FAULTS + len(CODES) * COUNTER
AT_RING: Final = AT_ALARMS + len(CODES) * ALARM.size
SIZE: Final = AT_RING + RING * CHANGE.size


@dataclass(frozen=True, kw_only=True)
class Change:
    """A change of state or reason: tick, monotonic time [s], and codes as in a recording."""

    tick: int
    now: float
    state: int
    reason: int
    fault: int


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """The whole block at one tick.

    latency, lateness : counts for each of BOUNDS
    alarms : what has ended runs, oldest first
    reasons, faults : by code: changes to this reason, ticks with this fault
    changes : the last ones, oldest first; `values.changes` tells how many there were
    """

    values: Values
    latency: Sequence[int]
    lateness: Sequence[int]
    reasons: dict[int, int]
    faults: dict[int, int]
    alarms: Sequence[Alarm]
    changes: Sequence[Change]


class Block:
    """The writer's side of a block in any writable buffer of SIZE bytes that are zero."""

    def __init__(self, buffer: Any) -> None:
        self._buffer = buffer
        view = memoryview(buffer)
        self._sequence = view[: SEQUENCE.size].cast("Q")
        self._latency = view[AT_LATENCY:AT_LATENESS].cast("Q")
        self._lateness = view[AT_LATENESS:AT_REASONS].cast("Q")
        self._reasons = view[AT_REASONS:AT_FAULTS].cast("Q")
        self._faults = view[AT_FAULTS:AT_ALARMS].cast("Q")
        self._state = self._reason = NOTHING
        self._since = self._latency_sum = self._latency_max = 0.0
        self._lateness_sum = self._lateness_max = 0.0
        self._images = self._runs = self._trips = self._changes = 0
        self._acknowledged = 0.0

    def update(self, tick: Tick) -> None:
        """Take one tick in."""
        self._sequence[0] += 1
        try:
            self._note_change(tick)
            self._count(tick)
            VALUES.pack_into(self._buffer, AT_VALUES, *self._values(tick))
        finally:
            self._sequence[0] += 1

    def _note_change(self, tick: Tick) -> None:
        state, reason = tick.state, tick.reason
        if state == self._state and reason == self._reason:
            return
        if state != self._state:
            self._since = tick.now
            self._runs += state == State.RUN
            if state == State.RAMPDOWN and reason not in BY_OPERATOR:
                self._trips += 1
                alarms.note(self._buffer, AT_ALARMS + PLACE[reason] * ALARM.size, tick.now)
            if (self._state, state) == (State.SAFE, State.SHADOW):
                self._acknowledged = tick.now
        if reason != self._reason:
            self._reasons[PLACE[reason]] += 1
        self._state, self._reason = state, reason
        place = AT_RING + self._changes % RING * CHANGE.size
        CHANGE.pack_into(self._buffer, place, tick.tick, tick.now, state, reason, tick.fault)
        self._changes += 1

    def _count(self, tick: Tick) -> None:
        latency, lateness = tick.latency, tick.lateness
        self._latency[bisect_left(BOUNDS, latency)] += 1
        self._lateness[bisect_left(BOUNDS, lateness)] += 1
        self._latency_sum += latency
        self._lateness_sum += lateness
        self._latency_max = max(self._latency_max, latency)
        self._lateness_max = max(self._lateness_max, lateness)
        self._images += tick.measurement is not None
        if tick.fault != NOTHING:
            self._faults[PLACE[tick.fault]] += 1

    def _values(self, tick: Tick) -> tuple[Any, ...]:
        """Fields of Values in their order."""
        measured, commanded = tick.measurement, tick.setpoint
        return (
            *(tick.now, self._since, tick.tick + 1, tick.tick + 1 - self._images, tick.missed),
            *(tick.overruns, tick.dropped, self._images, self._runs, self._trips, self._changes),
            *(
                self._acknowledged,
                tick.state,
                tick.reason,
                tick.fault,
                tick.shadow,
                number(tick.age),
            ),
            *(tick.latency, tick.lateness, self._latency_sum, self._latency_max),
            *(self._lateness_sum, self._lateness_max, number(tick.demand)),
            math.nan if commanded is None else number(commanded.speed_setpoint),
            *(
                (math.nan,) * 4
                if measured is None
                else (
                    number(measured.motor_speed),
                    number(measured.drum_speed),
                    number(measured.shaft_torque),
                    number(measured.armature_current),
                )
            ),
            *tick.implausible,
            tick.problem.encode(),
        )


def sequence(buffer: Any) -> int:
    """Sequence counter of a block."""
    return int(SEQUENCE.unpack_from(buffer)[0])


def copy(buffer: Any) -> bytes | None:
    """A whole copy of a block, None: the writer was at it."""
    before = sequence(buffer)
    content = bytes(memoryview(buffer)[:SIZE])
    return content if before % 2 == 0 and sequence(buffer) == before else None


def decode(content: bytes) -> Snapshot:
    """The block in a whole copy."""
    names = (one.name for one in fields(Values))
    values = Values(**dict(zip(names, VALUES.unpack_from(content, AT_VALUES), strict=True)))
    return Snapshot(
        values=values,
        latency=_counters(content, AT_LATENCY, AT_LATENESS),
        lateness=_counters(content, AT_LATENESS, AT_REASONS),
        reasons=dict(zip(CODES, _counters(content, AT_REASONS, AT_FAULTS), strict=True)),
        faults=dict(zip(CODES, _counters(content, AT_FAULTS, AT_ALARMS), strict=True)),
        alarms=alarms.decode(content, AT_ALARMS, CODES, values.acknowledged),
        changes=[
            _change(content, index)
            for index in range(max(0, values.changes - RING), values.changes)
        ],
    )


def _counters(content: bytes, start: int, end: int) -> tuple[int, ...]:
    return struct.unpack_from(f"<{(end - start) // COUNTER}Q", content, start)


def _change(content: bytes, index: int) -> Change:
    tick, now, state, reason, fault = CHANGE.unpack_from(
        content, AT_RING + index % RING * CHANGE.size
    )
    return Change(tick=tick, now=now, state=state, reason=reason, fault=fault)


def quantile(counts: Sequence[int], share: float) -> float:
    """Upper bound of the bin that holds this share of the durations [s]; NaN without any."""
    wanted, seen = max(1.0, share * sum(counts)), 0
    for bound, count in zip(BOUNDS, counts, strict=True):
        seen += count
        if seen >= wanted:
            return bound
    return math.nan
