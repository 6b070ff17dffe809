"""Detects outliers and lines of the mains in a residual (pure)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.noise.channel_noise import line_columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.estimation.noise.channel_noise import NoiseSeries
    from plant_emulator.signals.log import Array

# Departure from both neighbours that no signal of a machine makes [of the usual departure], and
# the distance of the neighbours that an outlier leaves them [of its departure].
OUTLYING, NEIGHBOURS = 7.0, 0.3
# Mains [Hz], and how far off they may be [Hz].
MAINS, MAINS_OFF = (50.0, 60.0), 0.2
# Gain of log evidence that a line needs: odds of e^15.
EVIDENCE = 15.0
# Step of the frequencies around the largest of the periodogram that are tried [turns in a run].
STEP = 0.1


def outlying(value: Array, use: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark single samples far from both neighbours, which lie near each other; shape (n,).

    value : in the declared noise
    """
    index = np.flatnonzero(use)
    found = np.zeros(len(value), bool)
    if len(index) < 5:
        return found
    v = value[index]
    off = np.abs(v[1:-1] - 0.5 * (v[2:] + v[:-2]))
    apart = np.abs(v[2:] - v[:-2])
    # A coarse channel that stands still has no departure at all.
    usual = max(1.0, 1.4826 * float(np.median(off)))
    found[index[1:-1]] = (off > OUTLYING * usual) & (apart < NEIGHBOURS * off)
    return found


def subtract_lines(s: NoiseSeries, use: NDArray[np.bool_], lines: Sequence[float]) -> Array:
    """The residual without its lines, by least squares, shape (n,)."""
    if not lines:
        return s.value
    columns = line_columns(s.time, lines)
    found = np.linalg.lstsq(columns[use], s.value[use], rcond=None)[0]
    return np.asarray(s.value - columns @ found)


def likely_lines(
    series: Sequence[NoiseSeries], uses: Sequence[NDArray[np.bool_]], deviation: float
) -> tuple[float, ...]:
    """Frequencies of the mains and their double [Hz], beside white noise; empty: not likely.

    An autoregression that was fitted to a line hides the line, hence the white noise.
    deviation : of the noise
    """
    longest = max(float(np.ptp(s.time)) for s in series)
    best: tuple[float, float] = (EVIDENCE, 0.0)
    for mains in MAINS:
        frequencies = np.arange(mains - MAINS_OFF, mains + MAINS_OFF, 0.25 / longest)
        gains = np.zeros(len(frequencies))
        for s, use in zip(series, uses, strict=True):
            value = s.value[use] - s.value[use].mean()
            power = periodogram(s.time[use], value, frequencies)
            gains += power / deviation**2 - np.log(max(2, len(value)))
        k = int(np.argmax(gains))
        best = max(best, (float(gains[k]), float(frequencies[k])))
    if not best[1]:
        return ()
    frequency = _refine_line(series, uses, best[1], longest)
    return (frequency, 2.0 * frequency)


def _refine_line(
    series: Sequence[NoiseSeries],
    uses: Sequence[NDArray[np.bool_]],
    frequency: float,
    longest: float,
) -> float:
    """The frequency nearby whose line and double leave the least squares [Hz].

    Sampling folds the double to nearly 0: half a turn missed in a run would look like a drift.

    frequency : largest of the periodogram, which the line's mirror image at half the sampling rate
        moves; longest : run [s]
    """
    from scipy.optimize import minimize_scalar

    def left(found: float) -> float:
        return sum(
            float(np.sum(subtract_lines(s, use, (found, 2.0 * found))[use] ** 2))
            for s, use in zip(series, uses, strict=True)
        )

    step = STEP / longest
    near = frequency + step * np.arange(-5.0, 6.0)
    best = float(near[int(np.argmin([left(f) for f in near]))])
    around = (best - step, best + step)
    return float(
        minimize_scalar(left, bounds=around, method="bounded", options={"xatol": 1e-3 * step}).x
    )


def periodogram(time: Array, value: Array, frequencies: Array) -> Array:
    """Squared amplitude |sum v exp(-i 2 pi f t)|^2 / n, at frequencies evenly spaced [Hz].

    time : [s], value : shape (n,) each
    """
    turn = np.exp(-2j * np.pi * frequencies[0] * time) * value
    step = np.exp(-2j * np.pi * (frequencies[1] - frequencies[0]) * time)
    found = np.empty(len(frequencies))
    for k in range(len(frequencies)):
        found[k] = np.abs(turn.sum()) ** 2
        turn *= step
    return found / max(1, len(value))
