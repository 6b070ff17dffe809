"""One sampled channel of a road log: even samples, what is missing, noise, low pass (pure).

The two channels come from two loggers with rates of their own. Each is brought to even samples at
its own rate here; stretches without information are remembered, not invented. The low pass runs
forwards and backwards and so shifts nothing; it is applied to the measured and the simulated
velocity alike, before either is thinned out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

Mask = NDArray[np.bool_]

SLOWEST = 20.0
"""Samples a second below which start and stop of a truck can no longer be told in time."""
HELD = 0.05
"""[s] from which a value that stands still in a noisy signal was held, not measured."""
ORDER = 2


@dataclass(frozen=True, kw_only=True)
class Signal:
    """Even samples of one channel.

    start : time of the first sample [s]; period [s]; values, shape (n,)
    known : where values rest on samples, shape (n,); elsewhere they are bridged by a line
    """

    start: float
    period: float
    values: Array
    known: Mask
    source: str

    @property
    def time(self) -> Array:
        """Times of the samples [s], shape (n,)."""
        return self.start + self.period * np.arange(len(self.values), dtype=np.float64)

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return self.start + self.period * (len(self.values) - 1)

    def gaps(self) -> list[tuple[float, float]]:
        """Start [s] and length [s] of every stretch without samples."""
        edges = np.flatnonzero(np.diff(np.r_[True, self.known, True].astype(np.int8)))
        firsts, lasts = edges[::2], edges[1::2]
        return [
            (self.start + self.period * (first - 1), self.period * (last - first + 1))
            for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True)
        ]


def signal(time: Array, values: Array, source: str, *, rest: float | None = None) -> Signal:
    """Even samples of a channel, time [s] strictly increasing, shape (n,) each.

    rest : the value at which the sensor may honestly stand still, if there is one
    Raises LogError where it was sampled too slowly, or sampled slower than it was written.
    """
    if len(time) < 50:
        raise LogError(f"{source}: {len(time)} samples; a run of some seconds is needed")
    _check_rate(time, values, source)
    measured = ~held(time, values, rest) & ~spikes(values)
    since, values = time[measured] - time[0], values[measured]
    period = period_of(since)
    grid = np.arange(int(np.round(since[-1] / period)) + 1)
    known = np.zeros(len(grid), dtype=np.bool_)
    known[np.clip(np.round(since / period).astype(np.int64), 0, len(grid) - 1)] = True
    even = np.interp(grid * period, since, values)
    # One or two samples that jitter took away, or a spike, are bridged and no gap.
    lost = trimmed(~known, 0, 0, 1 + min(2, int(0.01 / period)))
    return Signal(start=float(time[0]), period=period, values=even, known=~lost, source=source)


def period_of(time: Array) -> float:
    """Time between two samples [s], also where some are lost, late, or their stamps rounded.

    Stamps over their numbers, the numbers counted from stamp to stamp.
    """
    steps = np.diff(time)
    number = np.r_[0.0, np.cumsum(np.round(steps / np.median(steps)))]
    number -= number.mean()
    return float(number @ (time - time.mean()) / (number @ number))


def spikes(values: Array) -> Mask:
    """Lone samples far off the median of their five neighbours, shape (n,)."""
    from scipy.signal import medfilt

    off = np.abs(values - medfilt(values, 5))
    found: Mask = off > 12.0 * noise(values)
    found[[0, 1, -2, -1]] = False
    return found & (noise(values) > 0.0)


def _check_rate(time: Array, values: Array, source: str) -> None:
    rate = 1.0 / float(np.median(np.diff(time)))
    if rate < SLOWEST:
        raise LogError(f"{source}: {rate:.3g} samples a second; at least {SLOWEST:g} are needed")
    lengths = np.diff(np.flatnonzero(np.r_[True, np.diff(values) != 0.0, True]))
    usual = int(np.median(lengths))
    if len(lengths) > 50 and usual > 1 and np.mean(lengths == usual) > 0.8:
        raise LogError(
            f"{source}: every value stands {usual} times; it was sampled at {rate / usual:.4g} Hz "
            f"and held, keep one of {usual} rows"
        )


def held(time: Array, values: Array, rest: float | None) -> Mask:
    """Samples that only repeat the one before, shape (n,): a logger that waits for its sensor.

    Told by runs of equal values that are far longer than the signal's usual ones; one without
    noise, whose runs are long as a rule, has none, and runs at `rest` are none.
    """
    firsts = np.flatnonzero(np.r_[True, np.diff(values) != 0.0])
    lengths = np.diff(np.r_[firsts, len(values)])
    per_sample = np.repeat(lengths, lengths)
    if np.median(per_sample) > 5:
        return np.zeros(len(values), dtype=np.bool_)
    lasts = firsts + lengths - 1
    frozen = (lengths > 10) & (time[lasts] - time[firsts] >= HELD)
    if rest is not None:
        frozen &= values[firsts] != rest
    repeats = np.repeat(frozen, lengths)
    repeats[firsts] = False
    return repeats


def noise(values: Array) -> float:
    """Standard deviation of the white part of a signal, in its unit, from third differences.

    A smooth signal has none; their variance is 20 times that of the noise. Median of magnitudes,
    so that steps do not count. At least what rounding to the signal's smallest step makes.
    """
    steps = np.abs(np.diff(values))
    rounding = float(np.min(steps[steps > 0.0], initial=np.inf)) / np.sqrt(12.0)
    white = float(np.median(np.abs(np.diff(values, 3))) / 0.6745 / np.sqrt(20.0))
    return max(white, float(rounding)) if np.isfinite(rounding) else white


def low_pass(values: Array, period: float, cutoff: float) -> Array:
    """Values without what lies above `cutoff` [Hz]; Butterworth, forwards and backwards.

    A signal whose own rate holds nothing above it stays as it is.
    """
    from scipy.signal import butter, sosfiltfilt

    if cutoff * 2.0 * period >= 0.9:
        return values
    sections = butter(ORDER, cutoff, fs=1.0 / period, output="sos")
    found: Array = sosfiltfilt(sections, values)
    return found


def resting(velocity: Array, period: float) -> Mask:
    """Where the truck rests, shape (n,): its speed is 0 within the noise for 0.2 s and more.

    The first 0.1 s are left out, in which the low pass still brings some of the travel.
    """
    cutoff = 5.0
    smooth = low_pass(velocity, period, cutoff)
    quiet = np.abs(smooth) < max(0.006, 6.0 * noise(velocity) * np.sqrt(2.0 * cutoff * period))
    return trimmed(quiet, round(0.1 / period), 0, round(0.1 / period))


def trimmed(mask: Mask, head: int, tail: int, least: int) -> Mask:
    """Stretches of a mask without their first `head` and last `tail` samples, if `least` remain.

    A stretch that begins or ends with the log keeps that end.
    """
    found = np.zeros(len(mask), dtype=np.bool_)
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(np.int8)))
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        begin = first + head if first > 0 else 0
        end = last - tail if last < len(mask) else last
        found[begin:end] = end - begin >= least
    return found
