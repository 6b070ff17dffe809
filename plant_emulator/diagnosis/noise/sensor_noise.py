"""The noise of every channel, for the answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import SensorNoise
from plant_emulator.estimation.noise.channel_noise import ChannelNoise

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.machine import MeasuredRun
    from plant_emulator.signals.log import Array

# Time between new values over the sampling interval from which on a channel is held.
HELD_INTERVALS = 1.5


def sensor_noise(
    runs: Sequence[MeasuredRun], noise: Mapping[str, ChannelNoise]
) -> tuple[SensorNoise, ...]:
    """Describe the noise of every channel in the units of its log.

    noise : over the declared noise; a channel that is missing has white noise as declared
    """
    names = dict.fromkeys(name for run in runs for name in run.channels)
    return tuple(_channel(name, runs, noise.get(name, ChannelNoise())) for name in names)


def _channel(name: str, runs: Sequence[MeasuredRun], noise: ChannelNoise) -> SensorNoise:
    own = [(run, run.channels.index(name)) for run in runs if name in run.channels]
    variance = float(np.mean([run.noise[k] ** 2 for run, k in own]))
    interval = float(np.median(np.concatenate([np.diff(run.time) for run, _ in own])))
    periods = [_held_period(run.time, run.measured[k]) for run, k in own]
    return SensorNoise(
        channel=name,
        deviation=variance**0.5 * noise.total_deviation,
        correlation_time=interval * noise.colour.correlation_time,
        lines=noise.lines,
        outliers=noise.outliers,
        held_period=max(periods),
        white=noise.white,
    )


def _held_period(time: Array, channel: Array) -> float:
    """Median time between new values [s]; 0 where that is the sampling interval."""
    new = time[1:][np.diff(channel) != 0.0]
    if len(new) < 2:
        return 0.0
    period = float(np.median(np.diff(new)))
    return period if period > HELD_INTERVALS * float(np.median(np.diff(time))) else 0.0
