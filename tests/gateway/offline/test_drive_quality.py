"""Indices of SAE J2951 against a calculation by hand."""

import numpy as np
import pytest

from gateway.offline.drive_quality import drive_quality, indices, smooth


def one_newton(_speed: float) -> float:
    return 1.0


def test_indices_of_six_samples_are_those_of_the_hand_calculation():
    """2 kg, 1 N of road load while it moves, one sample a second.

    a on the road: 1 1 0.5 -0.5 -1 -1; F: 2 3 2 0 -1 -2; driving work 3 + 4 = 7 J, way 6 m.
    a on the bench: 1 1 0.5 0 -1 -2; F: 2 3 2 1 -1 -4; driving work 3 + 4 + 2 = 9 J, way 7 m.
    Inertia work 2 + 2 = 4 J on both; sum |a| 5 and 5.5 m/s; braking 1 J and 2 J.
    """
    road = np.array([0.0, 1.0, 2.0, 2.0, 1.0, 0.0])
    bench = np.array([0.0, 1.0, 2.0, 2.0, 2.0, 0.0])
    found = indices(1.0, road, bench, 2.0, one_newton)
    assert found.energy == pytest.approx(9.0 / 7.0 - 1.0)
    assert found.distance == pytest.approx(1.0 / 6.0)
    assert found.economy == pytest.approx(1.0 - (7.0 / 6.0) / (9.0 / 7.0))
    assert found.speed_change == pytest.approx(0.1)
    assert found.inertia_work == pytest.approx(0.0)
    assert found.speed_error == pytest.approx(np.sqrt(1.0 / 6.0))
    assert (found.braking_on_road, found.braking_on_bench) == (1.0, 2.0)


def test_two_means_of_five_points_spread_one_sample_over_nine():
    """The square of a box of 5 is a triangle: 1 2 3 4 5 4 3 2 1 of 25."""
    impulse = np.zeros(21)
    impulse[10] = 25.0
    assert smooth(impulse)[6:15] == pytest.approx([1, 2, 3, 4, 5, 4, 3, 2, 1])


def test_a_speed_up_to_30_millimetres_per_second_is_standstill():
    assert smooth(np.full(9, 0.03)).tolist() == [0.0] * 9
    assert smooth(np.full(9, 0.031)) == pytest.approx([0.031] * 9)


def test_a_bench_that_is_the_road_has_no_error_at_any_rate_of_sampling():
    time = np.arange(0.0, 20.0, 0.003)
    speed = 2.0 * np.sin(np.pi * time / 20.0) ** 2
    found = drive_quality(time, speed, speed, 3640.0, one_newton)
    assert found is not None
    assert found.to_json()["er_percent"] == 0.0
    assert found.to_json()["rmsse_km_h"] == 0.0


def test_noise_counts_as_inertia_work_only_without_the_filter():
    """5 mm/s of noise at 10 Hz are 70 mm/s^2; the two means leave less than a third of that."""
    time = np.arange(0.0, 30.0, 0.1)
    road = 3.8 * np.clip(np.minimum(time, 30.0 - time) / 6.0, 0.0, 1.0)
    bench = road + 0.005 * np.random.default_rng(1).standard_normal(len(time))
    raw = indices(0.1, road, bench, 3640.0, one_newton).inertia_work
    smoothed = indices(0.1, smooth(road), smooth(bench), 3640.0, one_newton).inertia_work
    assert raw > 0.05
    assert abs(smoothed) < raw / 3.0


@pytest.mark.parametrize("seconds", [0.5, 5.0])
def test_a_run_that_is_short_or_stands_has_no_indices(seconds):
    time = np.arange(0.0, seconds, 0.01)
    speed = np.zeros_like(time) if seconds > 1.0 else np.ones_like(time)
    assert drive_quality(time, speed, speed, 1.0, one_newton) is None
