"""Where in frequency a residual lies (pure).

Friction leaves its residual at the rate of the motion itself, below some hertz; elasticity, delays
and ripple leave theirs above. Compared with another run of the same machine, a band tells what that
run excites and the other does not (P. D. Welch, IEEE Trans. Audio Electroacoustics 15 (1967) 70).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

BANDS = ((0.2, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0), (20.0, 35.0), (35.0, 45.0))
"""[Hz]"""
SEGMENT = 5.0
"""[s] of a segment of the mean."""


def power(residual: Array, period: float, bands: Sequence[tuple[float, float]] = BANDS) -> Array:
    """Mean power density of a residual in each band [its unit^2/Hz], shape (bands,).

    residual : shape (n,); period : between its samples [s]; a band it cannot hold gives 0
    """
    from scipy.signal import welch

    length = min(len(residual), round(SEGMENT / period))
    frequency, density = welch(residual, 1.0 / period, nperseg=length)
    inside = [(frequency >= low) & (frequency < high) for low, high in bands]
    return np.array([density[some].mean() if some.any() else 0.0 for some in inside])
