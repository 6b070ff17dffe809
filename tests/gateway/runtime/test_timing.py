"""The histogram against numpy's exact quantiles."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.runtime.timing import WIDTH, Histogram


@given(st.lists(st.floats(0.0, 0.15), min_size=1, max_size=200), st.sampled_from([0.5, 0.99]))
def test_a_quantile_is_right_to_one_step(durations: list[float], share: float) -> None:
    found = Histogram()
    for duration in durations:
        found.add(duration)
    exact = float(np.quantile(durations, share, method="inverted_cdf"))
    assert exact <= found.quantile(share) + 1e-12
    assert found.quantile(share) <= exact + WIDTH + 1e-12


def test_the_longest_is_exact_however_long() -> None:
    found = Histogram()
    for duration in (0.001, 7.25, 0.002):
        found.add(duration)
    assert found.summary()["max"] == 7.25
    assert found.quantile(1.0) == 7.25
    assert found.total == 3


def test_an_empty_histogram_has_no_duration() -> None:
    assert Histogram().summary() == pytest.approx({"p50": 0.0, "p99": 0.0, "max": 0.0})
