"""Noise of the motor's balance against series whose variance is known."""

import numpy as np
import pytest

from gateway.plausibility.balance_noise import CLIP, CLIPPED, LOUD, QUIET, BalanceNoise, level, note


def shown(series, state=None):
    """Variances after each residual [N m], a window of 10 ms each."""
    state, variances = state or BalanceNoise(), []
    for residual in series:
        state = note(state, float(residual), 0.01)
        variances.append(state.variance)
    return state, variances


def test_white_noise_shows_its_variance_less_what_is_clipped():
    noise = 5.0 * np.random.default_rng(1).standard_normal(200_000)
    _, variances = shown(noise)
    assert np.mean(variances[5000:]) / CLIPPED == pytest.approx(25.0, rel=0.05)


def test_share_that_clipping_leaves_is_that_of_normal_noise():
    squares = np.random.default_rng(2).standard_normal(1_000_000) ** 2
    assert np.minimum(squares, CLIP * CLIPPED).mean() == pytest.approx(CLIPPED, abs=0.01)


def test_noise_that_changes_its_sign_from_window_to_window_counts_little():
    """Differences of noise a of 10 N m: 200 N^2 m^2 a window, but means of ten windows are apart by
    (a_20 - 2 a_10 + a_0) / 10. Its variance is 6 N^2 m^2, and ten halves of it are 30.
    """
    noise = np.diff(10.0 * np.random.default_rng(3).standard_normal(50_000))
    _, variances = shown(noise)
    assert np.mean(variances[5000:]) / CLIPPED == pytest.approx(30.0, rel=0.1)


def test_constant_error_is_no_noise():
    state, _ = shown(np.full(3000, 4.0))
    assert state.variance == QUIET


def test_fault_hardly_raises_the_level_until_it_trips():
    """6 N m more for 0.25 s: at most (4 - 1) * 0.25 / 10 of the variance."""
    before, _ = shown(np.zeros(100))
    after, _ = shown(np.full(25, 6.0), before)
    assert QUIET < after.variance <= QUIET * (1.0 + 3.0 * 0.025 * 1.1)


def test_noise_of_a_sensor_that_breaks_raises_the_level_to_a_bound():
    """300 N m of noise for 100 s."""
    state, _ = shown(300.0 * np.random.default_rng(4).standard_normal(10_000))
    assert state.variance == LOUD == 60.0


def test_level_by_hand():
    """20 * 9 / 0.9 N^2 m^2 * 0.01 s / (2 * 2 N m)."""
    assert level(BalanceNoise(variance=9.0), 2.0, 0.01, 20.0) == pytest.approx(0.5)
