"""Export of a recording as a log: the columns of a log, and the gateway's own columns.

A log has one row for each new sample of the PLC, timed by the PLC's clock. Ticks without a reading,
repeated samples and samples without a needed value have no row, because the time of a log increases
and its values are finite. With every tick, the time is that of the gateway, and cells may be empty.

The PLC says at a sample which reference it will have reached at the end of the next scan. The
reference of a log is that at the sample. It goes to the line of a new command as fast as the slew
rate allows; a log tells where it meets the line, between two samples, as the knee.

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
KNEE: Final = ("reference_knee_time_s", "reference_knee_rad_s")
TRUCK: Final = "truck_on_drum"
LIMITED: Final = 0.98
"""Share of a scan that a limited PLC needs at least; its registers round."""
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
    """

    samples: int = 0
    waited: float = 0.0
    truck: bool = False
    finite: dict[str, int] = field(default_factory=dict)
    quality: PollQuality = field(default_factory=lambda: PollQuality(interval=SCAN))


@dataclass(frozen=True, kw_only=True)
class Piece:
    """Some rows: records, times [s], and the knees of the reference, if known; see `knees_of`."""

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
            yield self._columns(Piece(rows=empty, time=np.zeros(0), knees=np.zeros((2, 0))))

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
        last, elapsed, echo = np.nan, 0.0, 0.0
        before = np.full((3, 2), np.nan)
        for rows in self.recording.chunks():
            new, repeated = new_samples(rows, last)
            self.survey.quality.repeated += repeated
            asked, before = commands(rows, before)
            if not len(new):
                continue
            found = rows[new].copy()
            clock = found["measured_plc_time"]
            time = unwrap_time(np.append(last, clock), self._modulus)[1:] + elapsed
            time = np.round(time, CLOCK_DIGITS)
            steps = np.diff(time, prepend=elapsed)
            self.survey.quality.count(steps[0 if np.isfinite(last) else 1 :].tolist())
            told = self._next_reference(found)
            begin = interpolate_reference(np.append(echo, told[:-1]), told, steps)
            knees = knees_of(begin, told, *asked[:, new])
            found[REFERENCE] = begin
            last, elapsed, echo = clock[-1], float(time[-1]), float(told[-1])
            whole = np.all([np.isfinite(found[name]) for name in NEEDED], axis=0)
            yield Piece(rows=found[whole], time=time[whole], knees=knees[:, whole])

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
            found |= dict(zip(KNEE, piece.knees, strict=True))
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


def interpolate_reference(before: Array, told: Array, steps: Array) -> Array:
    """Reference at each sample [rad/s]: what the sample before said, or a line across a hole.

    before, told : what the sample before and this one said of the end of the next scan [rad/s]
    steps : since the sample before [s]
    """
    share = np.maximum(steps - SCAN, 0.0) / np.maximum(steps, SCAN)
    return before + share * (told - before)


def knees_of(begin: Array, told: Array, rate: Array, slew: Array) -> Array:
    """Knee of the reference in the scan after each sample: seconds after it, and value [rad/s].

    From where it is, the PLC goes to the line of the command at its slew rate, and then along the
    line. Where it does not reach the line, the knee is the end of the scan. Shape (2, n).

    begin, told : where the scan begins and ends [rad/s]
    rate, slew : slope of the command's line, and largest slope [rad/s^2]; slew 0: not known
    """
    jump = told - begin - rate * SCAN
    needed = np.abs(jump) / np.maximum(slew - np.sign(jump) * rate, 1e-9)
    limited = needed >= LIMITED * SCAN
    after = np.where(limited, SCAN, needed)
    return np.stack([after, told - rate * (SCAN - after)])


def commands(records: Any, before: Array) -> tuple[Array, Array]:
    """Slope and slew rate that the PLC follows at each tick [rad/s^2], shape (2, ticks).

    The PLC follows the command of the tick before, or of the one before that, and tells its number.
    Also returned: slope, slew rate and number of the last two commands, shape (3, 2), as `before`.
    """
    names = ("speed_rate", "ramp_limit", "command_sequence")
    written = np.stack([records[f"setpoint_{name}"] for name in names])
    known = np.concatenate([before, written], axis=1)
    last, second_last = known[:, 1:-1], known[:, :-2]
    older = records["measured_command_sequence_echo"] == second_last[2]
    return np.nan_to_num(np.where(older, second_last, last)[:2]), known[:, -2:]


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
