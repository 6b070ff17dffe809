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

    order : of the derivative, 0 for the channel itself, at most 2; the result has the shape of the
        channel
    """
    length = min(window(time, seconds), len(time) - (1 - len(time) % 2))
    return fit_parabolas(channel, length, float(np.median(np.diff(time))), order)


def fit_parabolas(channel: Array, length: int, interval: float, order: int = 0) -> Array:
    """Smooth a channel, or its derivative, by parabolas over an odd number of samples.

    The parabolas of the first and last window also give the samples before and after their middles.
    interval : between samples [s]
    """
    half = length // 2
    places = np.arange(-half, half + 1.0)
    ones, zeros = np.ones(length), np.zeros(length)
    powers = np.stack([ones, places, places**2], axis=1)
    basis = (
        powers,
        np.stack([zeros, ones, 2.0 * places], axis=1),
        np.stack([zeros, zeros, 2.0 * ones], axis=1),
    )[order]
    inverse = np.linalg.pinv(powers)
    middle = np.convolve(channel, (basis[half] @ inverse)[::-1], "valid")
    first, last = inverse @ channel[:length], inverse @ channel[-length:]
    whole = np.concatenate([basis[:half] @ first, middle, basis[half + 1 :] @ last])
    return np.asarray(whole / interval**order)
