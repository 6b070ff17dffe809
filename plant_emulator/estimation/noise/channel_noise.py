"""The noise of a channel, and the linear map that makes a residual of the channel white (pure).

    e(t) = lines + u(t),   u(t) autoregressive

The lines are the mains and their double as the sampling folds them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.noise.autoregression import Autoregression, samples_since_break
from plant_emulator.recordings.recording import whiten_sensor_errors
from plant_emulator.signals.mains import line_columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

# Prior deviation of a line's amplitude, over that of the noise.
LINE_PRIOR = 3.0
# Lags of the test for whiteness.
LAGS = 20
# Ljung-Box excess from which on innovations are coloured: five of its standard deviations.
COLOURED = 5.0 * float(np.sqrt(2.0 * LAGS))
# Share of the variance that the past predicts from which on a residual is no noise of a sensor [1].
# Noise that is correlated over 30 ms at 100 Hz has 0.5; a wave that a model misses has 0.95.
MOST_PREDICTABLE = 0.7


@dataclass(frozen=True, kw_only=True)
class ChannelNoise:
    """The noise of a channel, in units of its declared noise.

    lines : frequencies of all runs [Hz]; disturbance : their mean square
    outliers : share of the samples [1]
    ljung_box_excess : of the innovations beyond white noise [chi squared, 0 +- sqrt(2 LAGS)]
    unsteady : share of the blocks whose innovations are louder than noise of one spectrum makes [1]
    """

    colour: Autoregression = field(default_factory=Autoregression)
    lines: tuple[float, ...] = ()
    outliers: float = 0.0
    disturbance: float = 0.0
    ljung_box_excess: float = 0.0
    unsteady: float = 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the noise without lines, in the declared noise [1]."""
        return self.colour.deviation

    @property
    def total_deviation(self) -> float:
        """Deviation of the noise with lines, without outliers, in the declared noise [1]."""
        return float(np.hypot(self.deviation, np.sqrt(self.disturbance)))

    @property
    def white(self) -> bool:
        """Whether the innovations are white."""
        return self.ljung_box_excess <= COLOURED

    @property
    def of_sensor(self) -> bool:
        """Whether a sensor may have such noise; otherwise the residual holds a misfit."""
        return self.white and self.colour.predictable <= MOST_PREDICTABLE


@dataclass(frozen=True)
class Whitener:
    """The linear map that makes a residual of one channel in one run white.

    use : samples that count; time : of all samples [s]; lines : frequencies in this run [Hz]
    """

    noise: ChannelNoise
    use: NDArray[np.bool_]
    time: Array
    lines: tuple[float, ...] = ()

    @cached_property
    def _places(self) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Samples that count, and how many before each are known without a break."""
        index = np.flatnonzero(self.use)
        return index, samples_since_break(self.time[index])

    @cached_property
    def _lines(self) -> Array:
        """Whitened columns of the lines, scaled to unit priors, shape (n, k)."""
        columns = line_columns(self.time, self.lines) * LINE_PRIOR * self.noise.deviation
        return np.stack([self.innovations(c) for c in columns.T], axis=-1)

    def innovations(self, value: Array) -> Array:
        """Innovations over their deviation, shape (n,); 0 where a sample does not count."""
        index, known = self._places
        found = np.zeros(len(value))
        found[index] = self.noise.colour.innovations(value[index], known)
        return found

    def white(self, value: Array) -> Array:
        """Whitened residual, shape (n,): white where the noise is all that the residual holds."""
        left = self.innovations(value)
        return whiten_sensor_errors(left, self._lines) if self.lines else left


def ljung_box_excess(runs: Sequence[Array]) -> float:
    """Ljung-Box statistic of innovations beyond its expected value [chi squared].

    All runs together (Ljung and Box, Biometrika 65 (1978) 297). A run of at most LAGS samples does
    not count, because it has no product at the largest lag.
    """
    total, square, count = np.zeros(LAGS), 0.0, 0
    for v in (run for run in runs if len(run) > LAGS):
        total += [float(v[k:] @ v[: len(v) - k]) for k in range(1, LAGS + 1)]
        square, count = square + float(v @ v), count + len(v)
    if square == 0.0:
        return 0.0
    terms = (total / square) ** 2 / (count - np.arange(1, LAGS + 1))
    return float(count * (count + 2.0) * terms.sum() - LAGS)
