"""Agreement of a simulation with a measurement: Val1, Val2, NRMSD.

    NRMSD = sqrt(mean e^2) / (max y - min y)    Val1 = 100 (1 - NRMSD)     (thesis, eq. 3.37-3.39)
    Val2  = 100 (1 - sum |e| / sum |y|)                                    (thesis, eq. 3.40-3.41)

e = y measured minus y simulated. Eq. 3.40 as printed divides by y in every sample, which is
undefined at standstill. The ratio of sums agrees with the thesis's tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.signals.log import COMPARED, VOLTAGE, Array, Log, compared_channels

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class ChannelFit:
    """Measures of one channel: val1 and val2 [%], nrmsd [1], rms of the residual [its unit]."""

    val1: float
    val2: float
    nrmsd: float
    rms: float


def fit(measured: Array, simulated: Array, place: str = "channel") -> ChannelFit:
    """Measures of a simulated channel against the measured one, shape (n,) each.

    place : name of the channel in an error
    Raises LogError for a measured channel that is constant or zero: its range is the divisor.
    """
    residual = measured - simulated
    span, total = float(np.ptp(measured)), float(np.abs(measured).sum())
    if span == 0.0 or total == 0.0:
        raise LogError(f"{place}: it does not move; a run that excites it is needed")
    rms = float(np.sqrt(np.mean(residual**2)))
    val2 = 100.0 * (1.0 - float(np.abs(residual).sum()) / total)
    return ChannelFit(100.0 * (1.0 - rms / span), val2, rms / span, rms)


@dataclass(frozen=True, kw_only=True)
class LogComparison:
    """A log beside its simulation; fits : measures by channel."""

    measured: Log
    simulated: Log
    fits: Mapping[str, ChannelFit]

    @property
    def source(self) -> str:
        """Name of the log."""
        return self.measured.source


def compare(measured: Log, simulated: Log) -> LogComparison:
    """Measure how well a simulation follows a log; errors as those of `fit`."""
    return LogComparison(measured=measured, simulated=simulated, fits=validate(measured, simulated))


def validate(measured: Log, simulated: Log) -> dict[str, ChannelFit]:
    """Measures of every channel on which the logs are compared, by its name."""
    return {
        name: fit(measured[name], simulated[name], f"{measured.source}: {name}")
        for name in compared_channels(measured)
    }


def zero_phase(log: Log, cutoff: float) -> Log:
    """Low-pass the compared channels of a log without phase shift, and drop its edges.

    A Butterworth filter of second order runs forwards and backwards. Measured and simulated logs
    need the same filter: filtering only one of them changes the spikes of the backlash.

    cutoff : frequency at which both passes together leave half of the amplitude [Hz]; one period of
        it is dropped at either end
    Raises LogError for a log that is too short or not evenly sampled.
    """
    from scipy.signal import butter, sosfiltfilt

    interval = float(np.median(np.diff(log.time)))
    if float(np.ptp(np.diff(log.time))) > 0.1 * interval:
        raise LogError(f"{log.source}: not evenly sampled; a filter needs one interval throughout")
    edge = round(1.0 / (cutoff * interval))
    if not 0.0 < cutoff < 0.5 / interval or len(log.time) < 4 * edge:
        raise LogError(
            f"{log.source}: cannot be filtered at {cutoff:g} Hz; a cut-off between "
            f"{4.0 / (len(log.time) * interval):.2g} and {0.5 / interval:g} Hz is needed"
        )
    sections = butter(2, cutoff, fs=1.0 / interval, output="sos")
    kept = slice(edge, -edge)
    signals = {
        name: sosfiltfilt(sections, values)[kept] if name in (*COMPARED, VOLTAGE) else values[kept]
        for name, values in log.signals.items()
    }
    return Log(log.time[kept], signals, log.source, log.other)
