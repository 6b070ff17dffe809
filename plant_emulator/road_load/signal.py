"""One channel of a road log: even samples, holes, noise, low pass and standstill (pure).

Two loggers with different rates record the two channels. This module resamples each channel to even
samples at its own rate and marks its holes. The low pass runs forwards and backwards, so it shifts
nothing. Measured and simulated velocity pass it before they are decimated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

Mask = NDArray[np.bool_]

LEAST_RATE = 20.0
"""Lowest sample rate that resolves starts and stops of a truck [1/s]."""
HELD_SPAN = 0.05
"""Shortest constant stretch of a noisy signal that the logger held instead of measured [s]."""
FILTER_ORDER = 2
"""Order of the Butterworth low pass, per direction."""


@dataclass(frozen=True, kw_only=True)
class Signal:
    """Even samples of one channel.

    start : time of the first sample [s]; period : time between samples [s]
    values : in the channel's unit, shape (n,), interpolated linearly in holes
    valid : where values are measured, shape (n,); source : name of the log
    """

    start: float
    period: float
    values: Array
    valid: Mask
    source: str

    @property
    def time(self) -> Array:
        """Times of the samples [s], shape (n,)."""
        return self.start + self.period * np.arange(len(self.values), dtype=np.float64)

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return self.start + self.period * (len(self.values) - 1)

    def holes(self) -> list[tuple[float, float]]:
        """Start [s] and length [s] of every stretch without samples."""
        edges = np.flatnonzero(np.diff(np.r_[True, self.valid, True].astype(np.int8)))
        firsts, lasts = edges[::2], edges[1::2]
        return [
            (self.start + self.period * (first - 1), self.period * (last - first + 1))
            for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True)
        ]


def signal(time: Array, values: Array, source: str, *, rest: float | None = None) -> Signal:
    """Even samples of a channel.

    time : strictly increasing [s], shape (n,); values : shape (n,)
    source : name of the log; rest : value at which a working sensor may stay constant
    Raises LogError if the sample rate is too low, or if the logger repeats every sample.
    """
    if len(time) < 50:
        raise LogError(f"{source}: {len(time)} samples; a run of some seconds is needed")
    _check_rate(time, values, source)
    measured = ~find_held(time, values, rest) & ~find_spikes(values)
    since, values = time[measured] - time[0], values[measured]
    period = period_of(since)
    grid = np.arange(int(np.round(since[-1] / period)) + 1)
    valid = np.zeros(len(grid), dtype=np.bool_)
    valid[np.clip(np.round(since / period).astype(np.int64), 0, len(grid) - 1)] = True
    even = np.interp(grid * period, since, values)
    # One or two samples lost by jitter, or one spike, are interpolated and do not make a hole.
    lost = trim(~valid, 0, 0, 1 + min(2, int(0.01 / period)))
    return Signal(start=float(time[0]), period=period, values=even, valid=~lost, source=source)


def period_of(time: Array) -> float:
    """Time between two samples [s], robust against lost samples, jitter and rounded stamps.

    It is the slope of a regression of the time stamps on the sample numbers.
    """
    steps = np.diff(time)
    number = np.r_[0.0, np.cumsum(np.round(steps / np.median(steps)))]
    number -= number.mean()
    return float(number @ (time - time.mean()) / (number @ number))


def find_spikes(values: Array) -> Mask:
    """Single samples far from the median of five neighbours, shape (n,)."""
    from scipy.signal import medfilt

    off = np.abs(values - medfilt(values, 5))
    found: Mask = off > 12.0 * noise(values)
    found[[0, 1, -2, -1]] = False
    return found & (noise(values) > 0.0)


def _check_rate(time: Array, values: Array, source: str) -> None:
    rate = 1.0 / float(np.median(np.diff(time)))
    if rate < LEAST_RATE:
        raise LogError(f"{source}: {rate:.3g} samples a second; at least {LEAST_RATE:g} are needed")
    lengths = np.diff(np.flatnonzero(np.r_[True, np.diff(values) != 0.0, True]))
    usual = int(np.median(lengths))
    if len(lengths) > 50 and usual > 1 and np.mean(lengths == usual) > 0.8:
        raise LogError(
            f"{source}: every value occurs {usual} times in a row; it was sampled at "
            f"{rate / usual:.4g} Hz and held, keep one of {usual} rows"
        )


def find_held(time: Array, values: Array, rest: float | None) -> Mask:
    """Samples that repeat the one before, because the logger held the value, shape (n,).

    They are runs of equal values that are much longer than usual. A signal without noise has long
    runs everywhere, so it has no held samples. Runs at the value `rest` do not count.
    """
    firsts = np.flatnonzero(np.r_[True, np.diff(values) != 0.0])
    lengths = np.diff(np.r_[firsts, len(values)])
    per_sample = np.repeat(lengths, lengths)
    if np.median(per_sample) > 5:
        return np.zeros(len(values), dtype=np.bool_)
    lasts = firsts + lengths - 1
    frozen = (lengths > 10) & (time[lasts] - time[firsts] >= HELD_SPAN)
    if rest is not None:
        frozen &= values[firsts] != rest
    repeats = np.repeat(frozen, lengths)
    repeats[firsts] = False
    return repeats


def noise(values: Array) -> float:
    """Standard deviation of a signal's white noise [its unit].

    Third differences cancel a smooth signal and multiply the variance of white noise by 20. The
    median of their magnitudes ignores steps. The result is at least the rounding error of the
    signal's smallest step.
    """
    steps = np.abs(np.diff(values))
    rounding = float(np.min(steps[steps > 0.0], initial=np.inf)) / np.sqrt(12.0)
    white = float(np.median(np.abs(np.diff(values, 3))) / 0.6745 / np.sqrt(20.0))
    return max(white, float(rounding)) if np.isfinite(rounding) else white


def low_pass(values: Array, period: float, cutoff: float) -> Array:
    """Values after a Butterworth low pass that runs forwards and backwards.

    period : of the samples [s]; cutoff : [Hz]
    A signal that is sampled too slowly to hold anything above the cutoff stays unchanged.
    """
    from scipy.signal import sosfiltfilt

    if cutoff * 2.0 * period >= 0.9:
        return values
    found: Array = sosfiltfilt(_sections(cutoff, 1.0 / period), values)
    return found


@cache
def _sections(cutoff: float, rate: float) -> Array:
    """Sections of the low pass; a fit asks for the same ones hundreds of times."""
    from scipy.signal import butter

    found: Array = butter(FILTER_ORDER, cutoff, fs=rate, output="sos")
    return found


def find_rests(velocity: Array, period: float) -> Mask:
    """Samples at which the truck stands, shape (n,): speed 0 within the noise for 0.2 s or more.

    The first 0.1 s of a standstill do not count, because the low pass smears the travel into them.
    """
    cutoff = 5.0
    smooth = low_pass(velocity, period, cutoff)
    slow = np.abs(smooth) < max(0.006, 6.0 * noise(velocity) * np.sqrt(2.0 * cutoff * period))
    return trim(slow, round(0.1 / period), 0, round(0.1 / period))


def trim(mask: Mask, head: int, tail: int, least: int) -> Mask:
    """Cut `head` samples from the start and `tail` samples from the end of every true stretch.

    A stretch that keeps fewer than `least` samples is dropped. A stretch at the start or end of the
    log keeps that end.
    """
    found = np.zeros(len(mask), dtype=np.bool_)
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(np.int8)))
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        begin = first + head if first > 0 else 0
        end = last - tail if last < len(mask) else last
        found[begin:end] = end - begin >= least
    return found
