"""Readings of declared sensors in a simulated run.

A lag is discretised exactly for a quantity u that is linear between its samples, h apart:

    y(t + h) = e y(t) + (1 - e - c) u(t) + c u(t + h),   e = exp(-h / tau),  c = 1 - (1 - e) tau / h

(first-order hold; K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, chapter 2). A run is
simulated at samples at most LAG_STEP apart for this, because the torque may change within a sample
of its log. The task of a PLC then reads the lagged value every period and holds it. The log does
not say when; the phase follows from the samples at which its values change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import KNEE, KNEES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from plant_emulator.model.sensors import Sensor
    from plant_emulator.signals.log import Array, Log

# Longest distance of the samples that a lag follows [s], the step of the running bench.
LAG_STEP = 1e-3
# A sample this share of a period before a reading counts as the reading itself: times are rounded.
# The same is the shortest time between two samples [s].
TIME_ROUNDING = 1e-6
# Phases of a task that are tried, at most.
PHASES = 64


@dataclass(frozen=True, kw_only=True)
class SensorMemory:
    """The state of a sensor between two blocks of samples.

    time, value : of the last sample of the quantity; lagged, shown : what followed from it
    """

    time: float
    value: float
    lagged: float
    shown: float


def at_rest(time: float, value: float) -> SensorMemory:
    """The memory of a sensor whose quantity has stood still up to this sample."""
    return SensorMemory(time=time, value=value, lagged=value, shown=value)


def lag(values: Array, intervals: Array, time_constant: float, start: float) -> Array:
    """First-order lag of a quantity that is linear between its samples, shape (n,).

    values : shape (n,); intervals : between them [s], shape (n - 1,)
    time_constant : [s], above 0; start : lagged value at the first sample
    """
    from scipy.linalg import solve_banded

    e = np.exp(-intervals / time_constant)
    c = 1.0 - (1.0 - e) * time_constant / intervals
    right = np.concatenate([[start], (1.0 - e - c) * values[:-1] + c * values[1:]])
    banded = np.stack([np.ones(len(values)), np.append(-e, 0.0)])
    return np.asarray(solve_banded((1, 0), banded, right, check_finite=False))


def count_readings(time: Array, period: float, phase: float) -> Array:
    """Number of the task's last reading at each time [1]; the reading 0 is at the phase [s]."""
    return np.asarray(np.floor((time - phase) / period + TIME_ROUNDING))


def follow(
    sensor: Sensor, before: SensorMemory, time: Array, values: Array, phase: float = 0.0
) -> tuple[Array, SensorMemory]:
    """Values that a sensor shows at these samples, shape (n,), and its memory after them.

    time, values : of the quantity, shape (n,) [s, its unit]; phase : of the task [s]
    """
    times = np.concatenate([[before.time], time])
    inner = np.concatenate([[before.value], values])
    if sensor.time_constant > 0.0:
        inner = lag(inner, np.diff(times), sensor.time_constant, before.lagged)
    shown = inner[1:]
    if sensor.period > 0.0:
        number = count_readings(times, sensor.period, phase)
        read = np.interp(phase + number[1:] * sensor.period, times, inner)
        shown = np.where(number[1:] > number[0], read, before.shown)
    memory = SensorMemory(
        time=float(time[-1]),
        value=float(values[-1]),
        lagged=float(inner[-1]),
        shown=float(shown[-1]),
    )
    return shown, memory


@dataclass(frozen=True, kw_only=True)
class Sensing:
    """The declared sensors of a run, and its finer samples.

    sensors : by channel; phases : of their tasks [s]
    time : finer samples at which the run is simulated [s], shape (m,)
    rows : place of each sample of the log among them, shape (n,)
    """

    sensors: Mapping[str, Sensor]
    phases: Mapping[str, float]
    time: Array
    rows: NDArray[np.intp]

    def show(self, name: str, values: Array) -> Array:
        """Values of a channel in the log, shape (n,); values : at the finer samples, shape (m,)."""
        if name not in self.sensors:
            return values[self.rows]
        start = at_rest(float(self.time[0]), float(values[0]))
        sensor, phase = self.sensors[name], self.phases[name]
        shown, _ = follow(sensor, start, self.time[1:], values[1:], phase)
        return np.concatenate([values[:1], shown])[self.rows]

    def has_new_reading(self, name: str) -> NDArray[np.bool_]:
        """Whether each sample of the log shows a new reading of a channel, shape (n,)."""
        time = self.time[self.rows]
        if name not in self.sensors or self.sensors[name].period == 0.0:
            return np.ones(len(time), bool)
        number = count_readings(time, self.sensors[name].period, self.phases[name])
        return np.diff(number, prepend=number[0] - 1.0) > 0.0


def sensing_of(log: Log, sensors: Mapping[str, Sensor]) -> Sensing | None:
    """The sensors of a log's channels, and its finer samples.

    None: every value shows its quantity at once, and the reference is straight between samples.
    """
    slow = {name: sensor for name, sensor in sensors.items() if not sensor.immediate}
    if not slow and KNEE not in log:
        return None
    time = np.union1d(finer(log.time) if slow else log.time, reference_nodes(log)[0])
    phases = {name: phase_of(log, name, sensor.period) for name, sensor in slow.items()}
    return Sensing(sensors=slow, phases=phases, time=time, rows=np.searchsorted(time, log.time))


def reference_nodes(log: Log) -> tuple[Array, Array]:
    """Times [s] and values [rad/s] between which the speed reference of a log is straight."""
    time, reference = log.time, log["speed_reference"]
    times, values, last = [time], [reference], np.zeros(len(time) - 1)
    for knee_time, knee in KNEES:
        if knee in log and knee_time in log:
            after = log[knee_time][:-1]
            # A knee in the rounding of a sample, or of the knee before it, is that one.
            inside = (after > last + TIME_ROUNDING) & (after < np.diff(time) - TIME_ROUNDING)
            last = np.where(inside, after, last)
            times.append((time[:-1] + after)[inside])
            values.append(log[knee][:-1][inside])
    order = np.argsort(np.concatenate(times), kind="stable")
    return np.concatenate(times)[order], np.concatenate(values)[order]


def finer(time: Array) -> Array:
    """Times at most LAG_STEP apart, those of `time` among them [s]."""
    pieces = np.maximum(1, np.ceil(np.diff(time) / LAG_STEP - TIME_ROUNDING)).astype(int)
    rows = np.concatenate([[0], np.cumsum(pieces)])
    found = np.interp(np.arange(rows[-1] + 1), rows, time)
    found[rows] = time
    return np.asarray(found)


def phase_of(log: Log, name: str, period: float) -> float:
    """Phase of the task that reads a channel [s]: no value may change without a reading.

    A reading is taken at a sample where that is possible. A log without the channel, as the inputs
    of a program, has the phase 0.
    """
    if period == 0.0 or name not in log:
        return 0.0
    changed = np.diff(log[name]) != 0.0
    if not changed.any():
        return 0.0
    shares = np.sort(np.mod(log.time[1:][changed] / period, 1.0))
    _, first = np.unique(np.floor(shares * PHASES), return_index=True)
    phases = period * shares[first]
    wrong = [
        np.sum(changed & (np.diff(count_readings(log.time, period, p)) == 0.0)) for p in phases
    ]
    return float(phases[int(np.argmin(wrong))])


class RunningSensor:
    """A declared sensor of the running bench, from block to block of its steps.

    seed : of the declared noise; None: the sensor shows no noise
    """

    def __init__(self, sensor: Sensor, seed: int | None = None) -> None:
        self._sensor = sensor
        self._memory = at_rest(0.0, 0.0)
        self._level = 0.0 if seed is None or sensor.noise is None else sensor.noise
        self._noise = 0.0
        self._random = np.random.default_rng(seed)

    def show(self, time: Array, values: Array) -> Array:
        """Compute the readings at the steps of a block, shape (n,) [unit of the channel].

        time, values : at the end of each step, shape (n,) [s, unit of the channel]
        """
        times = np.append(self._memory.time, time)
        shown, self._memory = follow(self._sensor, self._memory, time, values)
        return shown + self._draw(times)

    def _draw(self, times: Array) -> Array:
        """Noise of each step; times : of the step before the block, and of its steps [s]."""
        draws = self._level * self._random.standard_normal(len(times))
        draws[0] = self._noise
        if self._sensor.period > 0.0:
            fresh = np.diff(count_readings(times, self._sensor.period, 0.0), prepend=np.inf) > 0.0
            draws = draws[np.maximum.accumulate(np.where(fresh, np.arange(len(times)), 0))]
        self._noise = float(draws[-1])
        return np.asarray(draws[1:])
