"""Finds the lines of the mains in a channel, and the channel's noise beside them (pure)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.noise import NoiseSeries, deviation_without_outliers, noise

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

# Mains [Hz], and how far off they may be [Hz].
MAINS, MAINS_OFF = (50.0, 60.0), 0.2
# Gain of log evidence that a line needs: odds of e^15.
EVIDENCE = 15.0
# Deviation of third differences over that of white noise, 1 + 9 + 9 + 1 = 20, and where they are
# clipped.
DIFFERENCED, CLIP = float(np.sqrt(20.0)), 3.0
# Step of the frequencies around the largest of the periodogram that are tried [turns in a run].
STEP = 0.1


def line_columns(time: Array, lines: Sequence[float]) -> Array:
    """Cosine and sine of every line, and their drift over the run, shape (n, 4 k).

    The mains wander within a run as well, and a run of a minute does not tell its frequency
    exactly: amplitude and phase of a line change linearly.
    """
    turns = 2.0 * np.pi * np.outer(time, np.asarray(lines))
    waves = np.concatenate([np.cos(turns), np.sin(turns)], axis=1)
    drift = 2.0 * (time - time[0]) / np.ptp(time) - 1.0
    return np.concatenate([waves, waves * drift[:, None]], axis=1)


def subtract_lines(s: NoiseSeries, use: NDArray[np.bool_], lines: Sequence[float]) -> Array:
    """The residual without its lines, by least squares, shape (n,)."""
    if not lines:
        return s.value
    columns = line_columns(s.time, lines)
    found = np.linalg.lstsq(columns[use], s.value[use], rcond=None)[0]
    return np.asarray(s.value - columns @ found)


def likely_lines(
    series: Sequence[NoiseSeries],
    uses: Sequence[NDArray[np.bool_]],
    deviation: Callable[[float], float],
) -> list[tuple[float, ...]]:
    """Frequencies of the mains and their double in each run [Hz]; empty where not likely.

    The mains wander by hundredths of a hertz between runs, and a run of a minute shows that: each
    run has a frequency of its own. All runs together decide whether there are lines.
    An autoregression that was fitted to a line hides the line, hence the gain beside white noise.
    deviation : of white noise with the spectrum of the series at a frequency [Hz]
    """
    best: tuple[float, list[tuple[float, ...]]] = (EVIDENCE, [() for _ in series])
    for mains in MAINS:
        level = deviation(mains)
        of_runs = [_largest(s, use, mains, level) for s, use in zip(series, uses, strict=True)]
        total = sum(gain for gain, _ in of_runs if gain > 0.0)
        if total > best[0]:
            best = (total, [(f, 2.0 * f) if gain > 0.0 else () for gain, f in of_runs])
    return [
        _refine_lines(s, use, found) if found else ()
        for s, use, found in zip(series, uses, best[1], strict=True)
    ]


def noise_beside_lines(time: Array, channel: Array, use: NDArray[np.bool_]) -> float:
    """Standard deviation of a channel's noise beside the mains [its unit].

    time : [s], channel, use : samples that count, shape (n,) each
    """
    lines, level = lines_in_differences([NoiseSeries(time=time, value=channel, use=use)], [use])
    return level if lines[0] else noise(channel, use)


def lines_in_differences(
    series: Sequence[NoiseSeries], uses: Sequence[NDArray[np.bool_]]
) -> tuple[list[tuple[float, ...]], float]:
    """Lines of each run, see `likely_lines`, and the deviation of the noise beside them.

    A misfit of a model is smooth but for the instants that it misses, and hardly shows in third
    differences that are clipped. The lines do.
    """
    differences, levels = [], []
    for s, use in zip(series, uses, strict=True):
        level = noise(s.value, use) * DIFFERENCED or 1.0  # of a channel that stands still
        whole = use[3:] & use[2:-1] & use[1:-2] & use[:-3]
        clipped = np.clip(np.diff(s.value, 3), -CLIP * level, CLIP * level) / level
        differences.append(replace(s, time=s.time[3:], value=clipped, use=whole))
        levels.append(level)
    counted = [d.use for d in differences]
    if not all(use.any() for use in counted):  # a held channel has no four values in a row
        return [() for _ in series], 1.0
    interval = float(np.median(np.diff(series[0].time)))
    lines = likely_lines(
        differences,
        counted,
        lambda mains: abs(2.0 * np.sin(np.pi * mains * interval)) ** 3 / DIFFERENCED,
    )
    left = [
        level * deviation_without_outliers(subtract_lines(d, d.use, own)[d.use]) / DIFFERENCED
        for d, own, level in zip(differences, lines, levels, strict=True)
    ]
    return lines, float(np.median(left))


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
