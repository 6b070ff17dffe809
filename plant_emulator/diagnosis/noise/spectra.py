"""The spectrum of what a fit leaves of each channel, and that of the channel's noise model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.noise.channel_noise import ChannelNoise

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.signals.log import Array

# Samples of a segment, whose spectra are averaged.
SEGMENT_SAMPLES = 256


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """One-sided power spectral densities of a channel [unit^2/Hz], shape (n,).

    frequency : [Hz], shape (n,); lines : of hum [Hz]
    left : of what the fit leaves; noise : of the noise model without its lines
    """

    channel: str
    unit: str
    frequency: Array
    left: Array
    noise: Array
    lines: tuple[float, ...]


def spectra(
    model: Model, found: FitResult, runs: Sequence[int], noise: Mapping[str, ChannelNoise]
) -> tuple[Spectrum, ...]:
    """Spectra of every channel with a segment of samples.

    noise : by channel, over the declared noise; a channel that is missing has white noise
    """
    series: dict[tuple[str, str], list[tuple[float, float, Array]]] = {}
    for k, states in zip(runs, found.states, strict=True):
        run = model.runs[k]
        left = model.unwhitened_residual(k, found.effects)({**found.values, **states})
        for row, name, unit, level in zip(left, run.channels, run.units, run.noise, strict=True):
            counted = row != 0.0
            if np.count_nonzero(counted) >= SEGMENT_SAMPLES:
                interval = float(np.median(np.diff(run.time[counted])))
                one = (interval, float(level), row[counted])
                series.setdefault((name, unit), []).append(one)
    return tuple(
        _spectrum(name, unit, own, noise.get(name, ChannelNoise()))
        for (name, unit), own in series.items()
    )


def _spectrum(
    name: str, unit: str, runs: Sequence[tuple[float, float, Array]], noise: ChannelNoise
) -> Spectrum:
    interval = float(np.median([interval for interval, _, _ in runs]))
    level = float(np.sqrt(np.mean([level**2 for _, level, _ in runs])))
    frequency = np.asarray(np.fft.rfftfreq(SEGMENT_SAMPLES, interval)[1:], float)
    density = np.mean([welch(level * row, interval) for _, level, row in runs], axis=0)
    declared = (level / noise.total_deviation) ** 2
    return Spectrum(
        channel=name,
        unit=unit,
        frequency=frequency,
        left=density[1:],
        noise=declared * noise.colour.spectrum(frequency, interval),
        lines=noise.lines,
    )


def welch(series: Array, interval: float) -> Array:
    """One-sided power spectral density [unit^2/Hz], shape (SEGMENT_SAMPLES / 2 + 1,).

    The mean over half overlapping segments under a Hann window (P. D. Welch, IEEE Trans. Audio
    Electroacoust. 15 (1967) 70).
    interval : between samples [s]
    """
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(SEGMENT_SAMPLES) / SEGMENT_SAMPLES)
    starts = range(0, len(series) - SEGMENT_SAMPLES + 1, SEGMENT_SAMPLES // 2)
    segments = np.stack([series[k : k + SEGMENT_SAMPLES] for k in starts])
    segments = (segments - segments.mean(axis=1, keepdims=True)) * window
    power = np.mean(np.abs(np.fft.rfft(segments, axis=1)) ** 2, axis=0)
    power[1:-1] *= 2.0
    return np.asarray(power * interval / np.sum(window**2))
