"""The residual map: how large the gap of each channel is, and where.

The axes are operating phase, speed, load, direction, frequency and time since the start.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import Cell
from plant_emulator.diagnosis.localisation.operating_phases import (
    MOVING_SPEED,
    PHASES,
    field_weakened,
    phases,
)
from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Edges of the bins: frequency [Hz], as far as the sampling goes.
FREQUENCY_EDGES = (0.0, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
SPEED_BINS = (0.0, 25.0, 50.0, 100.0, 200.0, 300.0, 400.0)  # [rad/s at the motor]
TIME_BINS = (0.0, 5.0, 10.0, 20.0, 40.0, 80.0)  # [s since the start]
# There is a load from this torque at the sensor on [N m]: four deviations of its noise.
LOADED = 1.0


def residual_map(
    recordings: Sequence[Recording], residuals: Sequence[Array], base_speed: float
) -> tuple[Cell, ...]:
    """All cells of all axes, the runs pooled.

    residuals : of every run, over the noise [1], shape (channels, samples)
    base_speed : motor speed above which the field is weakened [rad/s]
    """
    masks = [bins(r, base_speed) for r in recordings]
    keys = dict.fromkeys(key for mask in masks for key in mask)
    cells = [
        cell for axis, name in keys for cell in _cells(recordings, residuals, masks, (axis, name))
    ]
    return (*cells, *_frequency_cells(recordings, residuals))


def bins(recording: Recording, base_speed: float) -> dict[tuple[str, str], NDArray[np.bool_]]:
    """Masks of the samples of a run, by axis and bin; base_speed : [rad/s]."""
    log = recording.log
    time, speed = log.time, smooth(log.time, log["motor_speed"], 0.1)
    torque = smooth(time, log["shaft_torque"], 0.1)
    phase = phases(time, log["speed_reference"], log["motor_speed"])
    found = {("phase", name): phase == k for k, name in enumerate(PHASES[:-1])}
    found["phase", PHASES[-1]] = field_weakened(speed, base_speed)
    found |= {("speed", n): m for n, m in _ranges(np.abs(speed), SPEED_BINS, "rad/s")}
    found["load", "driving"] = torque * speed < -LOADED * np.abs(speed)
    found["load", "braking"] = torque * speed > LOADED * np.abs(speed)
    found["load", "none"] = np.abs(torque) <= LOADED
    found["direction", "forward"] = speed > MOVING_SPEED
    found["direction", "backward"] = speed < -MOVING_SPEED
    return found | {("time", n): m for n, m in _ranges(time - time[0], TIME_BINS, "s")}


def _ranges(
    value: Array, edges: Sequence[float], unit: str
) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Name and mask of each bin of a quantity between the edges; the last bin is open."""
    for low, high in zip(edges, (*edges[1:], np.inf), strict=True):
        name = f"{low:g} to {high:g} {unit}" if high < np.inf else f"from {low:g} {unit}"
        yield name, (value >= low) & (value < high)


def _cells(
    recordings: Sequence[Recording],
    residuals: Sequence[Array],
    masks: Sequence[Mapping[tuple[str, str], NDArray[np.bool_]]],
    key: tuple[str, str],
) -> Iterator[Cell]:
    """Cells of one bin, all runs pooled.

    The noise of a channel is that of the samples in the bin, each with its own run's noise.
    """
    for channel in dict.fromkeys(c for r in recordings for c in r.channels):
        squares = variance = samples = 0.0
        for r, residual, mask in zip(recordings, residuals, masks, strict=True):
            if channel not in r.channels or key not in mask:
                continue
            row = r.channels.index(channel)
            inside = mask[key] & r.use[row]
            deviation = np.broadcast_to(r.noise[row] * r.noise_ratio[row], inside.shape)[inside]
            squares += float(np.sum((residual[row][inside] * deviation) ** 2))
            variance += float(np.sum(deviation**2))
            samples += len(deviation)
        if samples:
            yield _cell(channel, key, squares / samples, variance / samples, samples)


def _cell(channel: str, key: tuple[str, str], square: float, noise: float, samples: float) -> Cell:
    return Cell(
        channel=channel,
        axis=key[0],
        bin=key[1],
        gap=float(np.sqrt(square)),
        noise=float(np.sqrt(noise)),
        samples=int(samples),
    )


def _frequency_cells(recordings: Sequence[Recording], residuals: Sequence[Array]) -> Iterator[Cell]:
    """Cells of the frequency bands: gap and noise within each band (Parseval's theorem)."""
    for channel in dict.fromkeys(c for r in recordings for c in r.channels):
        for low, high in pairwise(FREQUENCY_EDGES):
            squares = variance = samples = degrees = 0.0
            for r, residual in zip(recordings, residuals, strict=True):
                if channel not in r.channels:
                    continue
                row = r.channels.index(channel)
                inside, power = _band(r.log.time, residual[row], low, high)
                n = len(r.log.time)
                squares += power * r.noise[row] ** 2
                variance += inside * r.noise[row] ** 2
                samples, degrees = samples + n, degrees + inside
            if degrees:
                key = ("frequency", f"{low:g} to {high:g} Hz")
                yield _cell(channel, key, squares / samples, variance / samples, degrees)


def _band(time: Array, residual: Array, low: float, high: float) -> tuple[float, float]:
    """Degrees of freedom of a residual in a band [Hz], and its sum of squares there."""
    n = len(residual)
    frequency = np.fft.rfftfreq(n, float(np.median(np.diff(time))))
    weight = np.where((frequency == 0.0) | ((n % 2 == 0) & (frequency == frequency[-1])), 1.0, 2.0)
    inside = (frequency >= low) & (frequency < high)
    power = np.abs(np.fft.rfft(residual)) ** 2 / n
    return float(weight[inside].sum()), float((weight * power)[inside].sum())
