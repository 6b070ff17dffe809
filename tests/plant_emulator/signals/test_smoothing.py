"""Smoothing by parabolas, against scipy's Savitzky-Golay filter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from plant_emulator.signals.smoothing import fit_parabolas

CHANNEL = np.random.default_rng(0).standard_normal(100)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_it_is_the_filter_of_savitzky_and_golay(order: int) -> None:
    expected = savgol_filter(CHANNEL, 21, 2, deriv=order, delta=0.01)
    assert np.allclose(fit_parabolas(CHANNEL, 21, 0.01, order), expected, rtol=1e-9, atol=1e-9)
