"""The held-out gap, the closed fraction and its interval, by hand."""

import numpy as np
import pytest

from plant_emulator.diagnosis.shrink import (
    Prediction,
    closed_fraction,
    combined,
    gap,
    interval,
)
from plant_emulator.estimates import Array


def prediction(*channels: Array) -> Prediction:
    """One run."""
    return Prediction(residuals=(np.stack(channels),), converged=True)


def constant(*levels: float) -> Prediction:
    """A run of 100 samples with these whitened residuals."""
    return prediction(*(np.full(100, level) for level in levels))


NAMES = [("a", "b")]


def test_closed_fraction_by_hand() -> None:
    """3 and 2 times the noise before, 1.5 and 1 after: 1 - (1.25 + 0) / (8 + 3)."""
    before = gap(NAMES, [constant(3.0, 2.0)], [10])
    after = gap(NAMES, [constant(1.5, 1.0)], [10])
    assert before.by_channel == pytest.approx([3.0, 2.0])
    assert closed_fraction(before, after) == pytest.approx(1 - 1.25 / 11)


def test_channel_at_the_noise_before_does_not_count() -> None:
    before = gap(NAMES, [constant(3.0, 1.05)], [10])
    after = gap(NAMES, [constant(1.0, 2.0)], [10])
    assert closed_fraction(before, after) == pytest.approx(1.0)


def test_no_gap_has_no_closed_fraction() -> None:
    before = gap(NAMES, [constant(1.0, 1.09)], [10])
    assert closed_fraction(before, before) is None
    assert interval(before, before) is None


def test_worse_prediction_closes_less_than_nothing() -> None:
    before = gap(NAMES, [constant(2.0, 2.0)], [10])
    after = gap(NAMES, [constant(3.0, 3.0)], [10])
    assert closed_fraction(before, after) == pytest.approx(1 - 16 / 6)


def test_samples_of_all_runs_are_pooled() -> None:
    both = gap(
        [("a",), ("a",)],
        [prediction(np.full(100, 3.0)), prediction(np.full(300, 1.0))],
        [10, 10],
    )
    assert both.by_channel == pytest.approx([np.sqrt((9 + 3) / 4)])


def test_samples_that_do_not_count_are_left_out() -> None:
    residual = np.full(100, 2.0)
    residual[:50] = 0.0
    found = gap([("a",)], [prediction(residual)], [10])
    assert found.by_channel == pytest.approx([2.0])


def test_channel_that_only_one_run_has_counts_there() -> None:
    found = gap([("a", "b"), ("a",)], [constant(2.0, 3.0), constant(1.0)], [10, 10])
    assert found.channels == ("a", "b")
    assert found.by_channel == pytest.approx([np.sqrt(2.5), 3.0])


def test_interval_covers_the_truth_at_its_rate() -> None:
    """Residuals with a memory of some samples; the truth from their variances: 1 - 0.69 / 3."""
    random, hits = np.random.default_rng(0), 0
    for _ in range(200):
        white = random.standard_normal((2, 3000 + 9))
        slow = np.array([np.convolve(w, np.ones(10) / np.sqrt(10), "valid") for w in white])
        before = gap([("a",)], [prediction(2.0 * slow[0])], [30])
        after = gap([("a",)], [prediction(1.3 * slow[1])], [30])
        found = interval(before, after)
        assert found is not None
        hits += found[0] <= 1 - 0.69 / 3 <= found[1]
    assert 0.88 <= hits / 200 <= 0.99


def test_combined_gap_is_the_rms_over_all_channels() -> None:
    value, low, high = combined(gap(NAMES, [constant(3.0, 1.0)], [10]))
    assert value == pytest.approx(np.sqrt(5.0))
    assert low == pytest.approx(high)  # nothing varies
