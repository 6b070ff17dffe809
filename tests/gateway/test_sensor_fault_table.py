"""The bound of a sensor fault against the same by hand."""

from dataclasses import replace

import numpy as np
import pytest

from tests.gateway.cycle.test_plausibility import DRIVING, P
from tests.gateway.sensor_fault_table import Pair, bound

DRUM = np.full(100, 2.0)


def steady(shown: float) -> list[Pair]:
    """The motor makes 18.506 N m, and the sensor shows this. Speeds have some noise."""
    pairs = []
    for number in range(100):
        rest = replace(DRIVING, drum_speed=2.0 + 0.001 * (-1) ** number)
        true = replace(
            rest, motor_speed=125.2 + 0.01 * (-1) ** number, shaft_torque_mean=DRIVING.shaft_torque
        )
        pairs.append((true, replace(true, shaft_torque_mean=shown)))
    return pairs


def test_dead_sensor_trips_when_its_error_beyond_the_tolerance_fills_the_level() -> None:
    """h = 0.43 N m s: 0.023 s without any tolerance, 0.033 s with 1 N m and 23 % of the torque."""
    assert P.motor_level == pytest.approx(0.43, abs=0.01)
    assert 0.025 < bound(P, steady(0.0), DRUM) < 0.045


def test_error_within_the_tolerance_has_no_bound() -> None:
    assert bound(P, steady(-16.0), DRUM) is None


def test_bench_at_the_far_side_of_its_tolerance_takes_more_than_twice_as_long() -> None:
    """18.5 N m less k = 5.3 N m fill h; less 2 k they fill 2 h: 2 (18.5 - 5.3) / (18.5 - 10.5)."""
    near, far = bound(P, steady(0.0), DRUM), bound(P, steady(0.0), DRUM, sides=2.0)
    assert near is not None
    assert far is not None
    assert 2.0 * near < far < 4.0 * near


def test_error_between_one_and_two_tolerances_is_never_certain() -> None:
    assert bound(P, steady(-11.0), DRUM) is not None
    assert bound(P, steady(-11.0), DRUM, sides=2.0) is None


def test_time_counts_while_the_drum_is_fast() -> None:
    slow = np.concatenate((np.full(2, 0.5), np.full(98, 2.0)))
    fast = bound(P, steady(0.0), DRUM)
    assert fast is not None
    assert bound(P, steady(0.0), slow) == pytest.approx(fast - 0.02)


def test_speed_that_stands_still_is_seen_after_twenty_samples() -> None:
    pairs = [(true, replace(true, drum_speed=2.0)) for true, _ in steady(-18.506)]
    assert bound(P, pairs, DRUM) == pytest.approx(0.21, abs=0.011)
