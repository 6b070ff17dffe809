"""Export of a recording as a log: the columns of a log, and the gateway's own columns.

A log has one row for each new sample of the PLC, timed by the PLC's clock. Ticks without a reading,
repeated samples and samples without a needed value have no row, because the time of a log increases
and its values are finite. With every tick, the time is that of the gateway, and cells may be empty.

The PLC says at a sample which reference it will have reached at the end of the next scan. The
reference of a log is that at the sample. A log tells the corners of the reference between two
samples, as knees: where it meets the line of a new command and, in a scan without a sample, what
the PLC made of the command that it had.

A recording may be large. It is read twice, piece by piece: to see what it holds, and to write.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from math import inf
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gateway.arrays import Array
from gateway.cycle.record import READ, WRITTEN
from gateway.recordings.header import map_of
from gateway.recordings.plc_reference import (
    NO_COMMANDS,
    Followed,
    Samples,
    commands,
    path_between,
)
from gateway.recordings.recording import GatewayRecording, Stream
from register_maps.logs.poll_quality import PollQuality
from register_maps.signals import LOG_COLUMNS, SIGNALS, Status
from register_maps.timing import SCAN
from register_maps.units import UNITS

Columns = dict[str, Any]
"""Column name with unit -> values."""

OWN: Final = {
    "tick": "tick",
    "demand_motor_speed_rad_s": "demand",
    "setpoint_motor_speed_rad_s": "setpoint_speed_setpoint",
    "sample_age_s": "age",
    "period_s": "period",
    "lateness_s": "lateness",
    "latency_s": "latency",
    "missed_deadlines": "missed",
    "dropped_records": "dropped",
}
NAMED: Final = {"state": "state", "reason": "reason", "tick_error": "fault"}
"""Columns of names. A column called fault would look like an answer to a diagnosis."""
SUFFIXES: Final = {
    "1": "",
    "s": "_s",
    "rad/s": "_rad_s",
    "N m": "_Nm",
    "N m s": "_Nms",
    "A": "_A",
    "V": "_V",
    "K": "_K",
}
NEEDED: Final = tuple(
    f"measured_{c.measured}"
    for c in LOG_COLUMNS.values()
    if c.needed and c.measured not in (None, "speed_reference")
)
REFERENCE: Final = "measured_speed_reference"
SAID: Final = ("measured_command_sequence_echo", "measured_command_age")
KNEES: Final = tuple(
    f"reference_knee{number}_{unit}" for number in ("", "_2", "_3") for unit in ("time_s", "rad_s")
)
TRUCK: Final = "truck_on_drum"
CLOCK_DIGITS: Final = 6
"""Digits of the time in seconds: finer than any PLC's clock, coarser than sums of floats."""


@dataclass(frozen=True, kw_only=True)
class Extent:
    """The ticks that become rows, by the time of the rows.

    every : every tick, also without a new sample; begin, end : of the time [s]
    """

    every: bool = False
    begin: float = -inf
    end: float = inf


@dataclass(kw_only=True)
class Survey:
    """Content of a recording: samples, and how often each field has a value.

    waited : from the start of the recording to time zero [s]
    truck : whether the bench was in road load, with a truck on the drum
    hidden : whether the reference of a scan without a sample is known
    """

    samples: int = 0
    waited: float = 0.0
    truck: bool = False
    hidden: bool = False
    finite: dict[str, int] = field(default_factory=dict)
    quality: PollQuality = field(default_factory=lambda: PollQuality(interval=SCAN))


@dataclass(frozen=True, kw_only=True)
class Piece:
    """Some rows: records, times [s], and knees of the reference, if known; see `ReferencePath`."""

    rows: Any
    time: Array
    knees: Array | None = None


class Export:
    """A recording as columns, piece by piece."""

    def __init__(self, recording: Stream, extent: Extent) -> None:
        self.recording, self.extent = recording, extent
        self._modulus = map_of(recording.header).modulus("plc_time")
        self.survey = Survey()
        for piece in self._pieces():
            self._take(piece)

    @property
    def start_date(self) -> datetime:
        """Date at which the time of the columns is zero."""
        date = datetime.fromisoformat(self.recording.header.date)
        return date + timedelta(seconds=self.survey.waited)

    def _take(self, piece: Piece) -> None:
        """Add a piece to the survey."""
        known, rows = self.survey, piece.rows
        if not known.samples and not self.extent.every:
            known.waited = float(rows["now"][0] - self.recording.header.started)
        status = rows["measured_status"]
        driven = np.nan_to_num(status).astype(int) & int(Status.ROAD_LOAD)
        known.truck = known.truck or bool(np.any(driven))
        known.hidden = known.hidden or (piece.knees is not None and bool(np.any(piece.knees[2])))
        inside = rows[self._inside(piece.time)]
        known.samples += len(inside)
        for name in (n for n in rows.dtype.names if rows[n].dtype.kind == "f"):
            found = int(np.isfinite(inside[name]).sum())
            known.finite[name] = known.finite.get(name, 0) + found

    def blocks(self) -> Iterator[Columns]:
        """The columns of the log, some rows at a time; the first block may have no rows."""
        begun = False
        for piece in self._pieces():
            inside = self._inside(piece.time)
            if inside.any() or not begun:
                begun = True
                yield {k: v[inside] for k, v in self._columns(piece).items()}
        if not begun:
            empty = np.zeros(0, dtype=np.dtype(self.recording.header.layout.formats))
            knees = np.zeros((len(KNEES), 0))
            yield self._columns(Piece(rows=empty, time=np.zeros(0), knees=knees))

    def _inside(self, time: Array) -> NDArray[np.bool_]:
        return np.asarray((time >= self.extent.begin) & (time <= self.extent.end))

    def _pieces(self) -> Iterator[Piece]:
        """Records that become rows, some at a time."""
        if not self.extent.every:
            yield from self._samples()
            return
        started = self.recording.header.started
        for rows in self.recording.chunks():
            yield Piece(rows=rows, time=rows["now"] - started)

    def _samples(self) -> Iterator[Piece]:
        """New samples with their times since the first one, by the PLC's clock."""
        self.survey.quality = PollQuality(interval=SCAN)
        last, elapsed = np.nan, 0.0
        waiting: tuple[Any, Array, Array] | None = None
        before, ended = NO_COMMANDS, Samples(*np.array([[np.nan], [np.nan], [0.0]]))
        for rows in self.recording.chunks():
            new, repeated = new_samples(rows, last)
            self.survey.quality.repeated += repeated
            followed, before = commands(rows, before)
            if not len(new):
                continue
            found = rows[new].copy()
            clock = found["measured_plc_time"]
            time = unwrap_time(np.append(last, clock), self._modulus)[1:] + elapsed
            time = np.round(time, CLOCK_DIGITS)
            steps = np.diff(time, prepend=elapsed)
            self.survey.quality.count(steps[0 if np.isfinite(last) else 1 :].tolist())
            own = Followed(*(command[:, new] for command in followed))
            number, age = (found[name] for name in SAID)
            said = Samples(number, age, self._next_reference(found))
            ahead = Samples(*(np.append(o, s[:-1]) for o, s in zip(ended, said, strict=True)))
            found[REFERENCE], knees, before_first = path_between(ahead, said, own, steps)
            ended = Samples(*(one[-1:] for one in said))
            last, elapsed = clock[-1], float(time[-1])
            if waiting is not None:  # only this piece tells the corners behind the last sample
                waiting[2][2:, -1] = before_first
                yield _of_whole_samples(*waiting)
            waiting = found, time, knees
        if waiting is not None:
            yield _of_whole_samples(*waiting)

    def _next_reference(self, rows: Any) -> Array:
        """Reference at the end of the next scan [rad/s]; without its register, the setpoint."""
        told: Array = rows[REFERENCE]
        asked = np.nan_to_num(rows["setpoint_speed_setpoint"])
        return np.where(np.isfinite(told), told, asked)

    def _columns(self, piece: Piece) -> Columns:
        """Every column that the recording can fill, by its name with unit."""
        found: Columns = {}
        rows = piece.rows
        for column in LOG_COLUMNS.values():
            if column.measured is not None and self._has_values(column.measured, log=True):
                unit = UNITS[column.unit]
                values = (rows[f"measured_{column.measured}"] - unit.shift) / unit.factor
                found[column.column] = values
        found["time_s"] = piece.time
        if piece.knees is not None:
            used = len(KNEES) if self.survey.hidden else 2
            found |= dict(zip(KNEES[:used], piece.knees, strict=False))
        if self.survey.truck:
            found[TRUCK] = np.ones(len(rows))
        kept = {name: key for name, key in OWN.items() if self.survey.finite.get(key, 1)}
        found |= {name: rows[key] for name, key in kept.items()}
        found["gateway_time_s"] = rows["now"] - self.recording.header.started
        found["written"] = (rows["flags"] & WRITTEN) > 0
        header = self.recording.header
        for name, key in NAMED.items():
            say = header.state if key == "state" else header.reason
            found[name] = np.array([say(int(code)) for code in rows[key]], dtype=str)
        return found | self._other_signals(rows)

    def _has_values(self, signal: str, *, log: bool) -> bool:
        """Whether a signal has values; in a log without every tick, at every sample."""
        count = self.survey.finite.get(f"measured_{signal}", 0)
        if log and not self.extent.every:
            return count == self.survey.samples
        return count > 0 or not self.survey.samples

    def _other_signals(self, rows: Any) -> Columns:
        """Measured signals that are no column of a log, in SI."""
        taken = {column.measured for column in LOG_COLUMNS.values()}
        return {
            f"{signal.name}{SUFFIXES[signal.unit]}": rows[f"measured_{signal.name}"]
            for signal in SIGNALS.values()
            if signal.kind == "measurement"
            and signal.name not in taken
            and self._has_values(signal.name, log=False)
        }


def _of_whole_samples(rows: Any, time: Array, knees: Array) -> Piece:
    """The samples that have every needed value."""
    whole = np.all([np.isfinite(rows[name]) for name in NEEDED], axis=0)
    return Piece(rows=rows[whole], time=time[whole], knees=knees[:, whole])


def new_samples(records: Any, last: float = np.nan) -> tuple[NDArray[np.intp], int]:
    """Indices of the ticks that read a new sample, and the number that read one again.

    last : PLC's time of the sample before the records [s]; NaN: there is none
    """
    read = np.flatnonzero(records["flags"] & READ)
    samples = records["measured_plc_time"][read]
    known = np.isfinite(samples)
    read, samples = read[known], samples[known]
    new: NDArray[np.intp] = read[np.diff(samples, prepend=last) != 0.0]
    return new, len(read) - len(new)


def unwrap_time(time: Array, modulus: float | None) -> Array:
    """Time since the first sample [s] from a clock that wraps at `modulus` (None: never).

    A first sample that is not a number is the time of the second one.
    """
    steps = np.nan_to_num(np.diff(time, prepend=time[:1]))
    return np.cumsum(steps if modulus is None else np.mod(steps, modulus))


def of_recording(recording: GatewayRecording) -> NDArray[np.intp]:
    """Indices of the ticks of a recording that read a new sample."""
    return new_samples(recording.records)[0]
