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


def outlying(value: Array, use: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark single samples far from both neighbours, which lie near each other; shape (n,).

    value : in the declared noise
    """
    index = np.flatnonzero(use)
    found = np.zeros(len(value), bool)
    if len(index) < 5:
        return found
    v = value[index]
    off = np.abs(v[1:-1] - 0.5 * (v[2:] + v[:-2]))
    apart = np.abs(v[2:] - v[:-2])
    # A coarse channel that stands still has no departure at all.
    usual = max(1.0, 1.4826 * float(np.median(off)))
    found[index[1:-1]] = (off > OUTLYING * usual) & (apart < NEIGHBOURS * off)
    return found
