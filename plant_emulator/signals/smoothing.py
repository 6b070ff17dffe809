"""Smooths channels and differentiates them (A. Savitzky, M. Golay, Anal. Chem. 36 (1964) 1627)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


def window(time: Array, seconds: float) -> int:
    """Odd number of samples that is closest to a length of time [s], at least 5."""
    interval = float(np.median(np.diff(time)))
    return max(5, 2 * round(seconds / interval / 2) + 1)


def smooth(time: Array, channel: Array, seconds: float, order: int = 0) -> Array:
    """Smooth a channel, or its derivative, by parabolas over windows of so many seconds.

    order : of the derivative, 0 for the channel itself; the result has the shape of the channel
    """
    from scipy.signal import savgol_filter

    length = min(window(time, seconds), len(time) - (1 - len(time) % 2))
    interval = float(np.median(np.diff(time)))
    return np.asarray(savgol_filter(channel, length, 2, deriv=order, delta=interval))
