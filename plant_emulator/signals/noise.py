"""Estimates the noise of a measured channel from its third differences.

The third difference of white noise with standard deviation s has the standard deviation s sqrt(20),
since 1 + 9 + 9 + 1 = 20. The third difference of a smooth signal is small. Spikes and steps of the
signal are outliers. Differences beyond CLIP standard deviations are left out until nothing changes,
and the result is corrected for the truncated normal distribution. A median would jump from level to
level with a quantised sensor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

CLIP = 3.0
# Standard deviation of a standard normal distribution that is truncated at 3 deviations.
TRUNCATED_DEVIATION = 0.986578
# Least noise as a share of the channel's range: a log without noise still has rounding.
FLOOR = 2e-4
# Distance of two values that is none, over the range; and the least share of the usual distance
# that the shorter ones have where values are steps apart.
DUST, EVEN = 1e-9, 0.9


@dataclass(frozen=True, kw_only=True)
class NoiseSeries:
    """The residual of a channel in one run, in units of the channel's declared noise.

    time : [s], value : residual, use : samples that count, shape (n,) each
    """

    time: Array
    value: Array
    use: NDArray[np.bool_]


def noise(channel: Array, use: NDArray[np.bool_] | None = None) -> float:
    """Standard deviation of a channel's noise [its unit], shape (n,).

    use : samples that count, shape (n,). A difference counts if all of its four samples count. In
        a channel that is slower than its log no four samples in a row count; the samples that
        count are then taken as neighbours.
    """
    counted = np.ones(len(channel), bool) if use is None else use
    whole = counted[3:] & counted[2:-1] & counted[1:-2] & counted[:-3]
    differences = np.diff(channel, 3)[whole]
    if 4 * len(differences) < counted.sum():
        differences = np.diff(channel[counted], 3)
    floor = FLOOR * float(np.ptp(channel))
    if len(differences) == 0:
        return floor
    return max(deviation_without_outliers(differences) / float(np.sqrt(20.0)), floor)


def deviation_without_outliers(differences: Array) -> float:
    """Standard deviation of normal values among outliers [their unit], shape (n,)."""
    deviation = 1.4826 * float(np.median(np.abs(differences)))
    for _ in range(50):
        inner = differences[np.abs(differences) <= CLIP * deviation]
        renewed = float(np.sqrt(np.mean(inner**2))) / TRUNCATED_DEVIATION if len(inner) else 0.0
        if abs(renewed - deviation) <= 1e-6 * deviation:
            break
        deviation = renewed
    return deviation


def value_step(channel: Array) -> float:
    """Step that the values of a quantised channel are apart [its unit]; 0: it has none.

    channel : shape (n,)
    """
    apart = np.diff(np.unique(channel))
    apart = apart[apart > DUST * np.ptp(channel)]
    if len(apart) == 0:
        return 0.0
    low, usual = np.quantile(apart, (0.1, 0.5))
    return float(usual) if low > EVEN * usual else 0.0
