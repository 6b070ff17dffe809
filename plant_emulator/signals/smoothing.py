"""Channels and their derivatives without their noise (A. Savitzky, M. Golay, 1964; pure)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


def window(time: Array, seconds: float) -> int:
    """Odd number of samples nearest to a length of time, at least 5."""
    interval = float(np.median(np.diff(time)))
    return max(5, 2 * round(seconds / interval / 2) + 1)


def smooth(time: Array, channel: Array, seconds: float, order: int = 0) -> Array:
    """A channel, or its derivative of an order, from parabolas over windows of a length [s]."""
    from scipy.signal import savgol_filter

    length = min(window(time, seconds), len(time) - (1 - len(time) % 2))
    interval = float(np.median(np.diff(time)))
    return np.asarray(savgol_filter(channel, length, 2, deriv=order, delta=interval))
