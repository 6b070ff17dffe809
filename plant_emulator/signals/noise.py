"""Noise of a measured channel, from its third differences.

A third difference of white noise of standard deviation s has the standard deviation s sqrt(20)
(1 + 9 + 9 + 1), and none of a signal that is smooth over four samples. Spikes and steps of the
signal lie outside the bulk and are left out: the deviation is that of the differences within
CLIP deviations, repeated until nothing changes, and corrected for what the cut takes of a normal
distribution. A median would do, but quantised sensors make it jump from level to level.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

CLIP = 3.0
# Standard deviation left of a normal distribution cut at 3 deviations.
LEFT = 0.986578
# A log without noise still has digits: at least this share of the channel's range.
FLOOR = 2e-4


def noise(channel: Array, use: NDArray[np.bool_] | None = None) -> float:
    """Standard deviation of a channel's noise [its unit], shape (n,).

    use : samples that count; a difference counts if all of its samples do. Of a channel that is
        slower than its log no four in a row do, and those that do are taken as neighbours
    """
    counted = np.ones(len(channel), bool) if use is None else use
    whole = counted[3:] & counted[2:-1] & counted[1:-2] & counted[:-3]
    differences = np.diff(channel, 3)[whole]
    if 4 * len(differences) < counted.sum():
        differences = np.diff(channel[counted], 3)
    floor = FLOOR * float(np.ptp(channel))
    if len(differences) == 0:
        return floor
    deviation = 1.4826 * float(np.median(np.abs(differences)))
    for _ in range(50):
        inner = differences[np.abs(differences) <= CLIP * deviation]
        renewed = float(np.sqrt(np.mean(inner**2))) / LEFT if len(inner) else 0.0
        if abs(renewed - deviation) <= 1e-6 * deviation:
            break
        deviation = renewed
    return max(float(deviation / np.sqrt(20.0)), floor)
