"""Detects outliers in a residual (pure)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

# Departure from both neighbours that no signal of a machine makes [of the usual departure], and
# the distance of the neighbours that an outlier leaves them [of its departure].
OUTLYING, NEIGHBOURS = 7.0, 0.3
# Samples of a channel that show what is usual.
FEWEST = 5


def outlying(value: Array, use: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark samples far from both neighbours, which lie near each other; shape (n,).

    Two in a row are marked too where single ones are more frequent: chance strikes neighbours now
    and then, while a machine that is struck takes several samples every time.

    value : in the declared noise
    """
    index = np.flatnonzero(use)
    found = np.zeros(len(value), bool)
    if len(index) < FEWEST:
        return found
    v = value[index]
    single, double = _struck(v, 1), _struck(v, 2)
    double[:-1] &= ~(single[:-1] | single[1:])
    found[index] = single
    if np.count_nonzero(double) < np.count_nonzero(single):
        found[index] |= double | np.roll(double, 1)
    return found


def _struck(value: Array, count: int) -> NDArray[np.bool_]:
    """Mark the first of so many samples that are all far from the neighbours on both sides."""
    before, after = value[: -count - 1], value[count + 1 :]
    middle, apart = 0.5 * (before + after), np.abs(after - before)
    off = np.min([np.abs(value[k : k + len(middle)] - middle) for k in range(1, count + 1)], axis=0)
    # A coarse channel that stands still has no departure at all.
    usual = max(1.0, 1.4826 * float(np.median(off)))
    struck = (off > OUTLYING * usual) & (apart < NEIGHBOURS * off)
    return np.pad(struck, (1, count))
