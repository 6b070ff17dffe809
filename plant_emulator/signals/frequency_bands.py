"""Power of a residual in frequency bands (P. D. Welch, IEEE Trans. Audio Electroac. 15 (1967) 70).

An error in the friction leaves a residual at the rate of the motion, below a few hertz. Errors in
elasticity, delays and ripple leave residuals above. The bands of two runs of one machine show what
one run excites and the other does not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

BANDS = ((0.2, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0), (20.0, 35.0), (35.0, 45.0))
"""Frequency bands [Hz]."""
SEGMENT_TIME = 5.0
"""Length of the segments that the spectra are averaged over [s]."""


def power(residual: Array, period: float, bands: Sequence[tuple[float, float]] = BANDS) -> Array:
    """Mean power density of a residual in each band [its unit^2/Hz], shape (bands,).

    residual : shape (n,); period : time between its samples [s]
    A band above the Nyquist frequency has the power 0.
    """
    from scipy.signal import welch

    length = min(len(residual), round(SEGMENT_TIME / period))
    frequency, density = welch(residual, 1.0 / period, nperseg=length)
    inside = [(frequency >= low) & (frequency < high) for low, high in bands]
    return np.array([density[some].mean() if some.any() else 0.0 for some in inside])
