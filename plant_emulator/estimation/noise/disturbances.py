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
) -> list[tuple[float, ...]]:
    """Frequencies of the mains and their double in each run [Hz]; empty where not likely.

    The mains wander by hundredths of a hertz between runs, and a run of a minute shows that: each
    run has a frequency of its own. All runs together decide whether there are lines.
    An autoregression that was fitted to a line hides the line, hence the gain beside white noise.
    deviation : of the noise
    """
    best: tuple[float, list[tuple[float, ...]]] = (EVIDENCE, [() for _ in series])
    for mains in MAINS:
        of_runs = [_largest(s, use, mains, deviation) for s, use in zip(series, uses, strict=True)]
        total = sum(gain for gain, _ in of_runs if gain > 0.0)
        if total > best[0]:
            best = (total, [(f, 2.0 * f) if gain > 0.0 else () for gain, f in of_runs])
    return [
        _refine_lines(s, use, found) if found else ()
        for s, use, found in zip(series, uses, best[1], strict=True)
    ]


def _largest(
    s: NoiseSeries, use: NDArray[np.bool_], mains: float, deviation: float
) -> tuple[float, float]:
    """Gain of log evidence of the likeliest line near the mains in a run, and its frequency [Hz].

    Amplitude, phase and frequency each take half the logarithm of the samples (Schwarz).
    """
    count = int(use.sum())
    if count < 2:
        return 0.0, mains
    step = 0.25 / float(np.ptp(s.time))
    frequencies = np.arange(mains - MAINS_OFF, mains + MAINS_OFF, step)
    power = periodogram(s.time[use], s.value[use] - s.value[use].mean(), frequencies)
    k = int(np.argmax(power))
    return float(power[k]) / deviation**2 - 1.5 * float(np.log(count)), float(frequencies[k])


def _refine_lines(
    s: NoiseSeries, use: NDArray[np.bool_], lines: tuple[float, ...]
) -> tuple[float, ...]:
    """The line nearby that leaves the least squares, and its double [Hz].

    Sampling folds the double to nearly 0: half a turn missed in a run would look like a drift. The
    line alone tells the frequency, because near 0 a misfit of the model passes for the double.

    lines : largest of the periodogram, which the line's mirror image at half the sampling rate
        moves, and its double
    """
    from scipy.optimize import minimize_scalar

    def left(found: float) -> float:
        turns = 2.0 * np.pi * found * s.time[use]
        waves = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        amplitudes = np.linalg.lstsq(waves, s.value[use], rcond=None)[0]
        return float(np.sum((s.value[use] - waves @ amplitudes) ** 2))

    step = STEP / float(np.ptp(s.time))
    near = lines[0] + step * np.arange(-10.0, 11.0)
    best = float(near[int(np.argmin([left(f) for f in near]))])
    around = (best - step, best + step)
    found = minimize_scalar(left, bounds=around, method="bounded", options={"xatol": 1e-3 * step})
    return (float(found.x), 2.0 * float(found.x))


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
