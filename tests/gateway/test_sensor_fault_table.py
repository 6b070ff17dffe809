"""The bound of a sensor fault against the same by hand."""

import numpy as np
import pytest

from tests.gateway.sensor_fault_table import DRIFT, DRIFT_SHARE, HISTORY, bound

WHITE = np.array([9.0])
"""Autocovariance of white noise of 3 N m."""
STEADY = np.full(HISTORY + 60, 10.0)
"""[N m] Torque of the motor."""


def time_of(error, covariance=WHITE, rarity=12.5, torque=STEADY, noise=0.0):
    """Bound of a balance that shows the error and this noise."""
    return bound(
        np.concatenate((np.zeros(HISTORY), error)) + noise, error, torque, covariance, rarity
    )


def test_error_trips_when_its_energy_exceeds_twice_the_rarity() -> None:
    """6 N m over 3 N m: 4 a window, less what drift may explain of it in view of the history.

    n windows and 100 without an error: the best constant is 6 n / (100 + n), which leaves
    4 n (1 - n / (100 + n)): 22.6 after 6 windows and 26.2 after 7; 25 are needed.
    """
    assert time_of(np.full(60, 6.0)) == pytest.approx(0.07)


def test_error_with_less_energy_has_no_bound() -> None:
    """1 N m: 60 windows have 60 / 9 (1 - 60 / 160) = 4.2."""
    assert time_of(np.full(60, 1.0)) is None


def test_noise_that_changes_its_sign_from_scan_to_scan_hides_less() -> None:
    blue = np.array([9.0, -4.0])
    slow, fast = (time_of(np.full(60, 3.0), one) for one in (WHITE, blue))
    assert slow is not None
    assert fast is not None
    assert fast < 0.7 * slow


def test_error_that_follows_a_change_of_the_torque_may_be_drift() -> None:
    """The torque goes up by 100 N m: 17 % of it, from a constant that was wrong all along."""
    rising = np.concatenate(([0.0], np.full(59, 100.0)))
    torque = np.concatenate((np.zeros(HISTORY), rising))
    drifted = DRIFT_SHARE * rising
    assert time_of(drifted, torque=torque) is None
    assert time_of(2.0 * drifted, torque=torque) is not None
    assert DRIFT > 0.0


def test_noise_alone_is_taken_for_the_fault_as_rarely_as_told() -> None:
    """exp(-3) = 5 % of 100 sound runs at most; a binomial deviation of it is 2.2 %."""
    random, error = np.random.default_rng(1), np.full(30, 6.0)
    runs = 3.0 * random.standard_normal((100, HISTORY + 30))
    taken = [bound(one, error, STEADY[:-30], WHITE, 3.0) is not None for one in runs]
    assert 0.0 < np.mean(taken) <= 0.05 + 0.022
