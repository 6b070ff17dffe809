"""The false alarms that largest sums let expect, against the exponential law by hand."""

import numpy as np
import pytest

from tests.gateway.drifted_bench import expected_alarms, upper_limit


def test_alarms_follow_from_the_exponential_tail() -> None:
    """P(X > x) = exp(-(x - 0.5) / 0.05): exp(-10) = 4.5e-5 of the 6000 minutes are above 1."""
    drawn = 0.5 + np.random.default_rng(1).exponential(0.05, (200000, 1))
    assert expected_alarms(drawn) == pytest.approx(6000.0 * 4.54e-5, rel=0.1)


def test_relation_that_never_moves_gives_no_alarm() -> None:
    assert expected_alarms(np.zeros((20, 1))) == 0.0


def test_upper_limit_holds_the_truth_of_drives_that_differ() -> None:
    """Of 40 drives each shifted by its own bench; the truth is what 4000 drives expect."""
    random = np.random.default_rng(2)

    def drives(count: int) -> np.ndarray:
        shift = 0.05 * random.standard_normal((count, 1, 1))
        return 0.4 + shift + random.exponential(0.05, (count, 6, 1))

    truth = expected_alarms(np.concatenate(drives(4000)))
    assert sum(upper_limit(drives(40)) > truth for _ in range(20)) >= 16
