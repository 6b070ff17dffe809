"""The false alarms that largest sums let expect, against the Gumbel law by hand."""

import numpy as np
import pytest

from tests.gateway.drifted_bench import expected_alarms


def test_alarms_follow_from_the_quantile_of_the_gumbel_law() -> None:
    """Of drives of 360 s with beta = 0.05 and mu = 1 - 5 beta, exp(-5) = 0.67 % are above 1."""
    drawn = np.random.default_rng(1).gumbel(0.75, 0.05, (200000, 1))
    assert expected_alarms(drawn, 360.0) == pytest.approx(1000 * 0.00671, rel=0.03)


def test_relation_that_never_moves_gives_no_alarm() -> None:
    assert expected_alarms(np.zeros((20, 1)), 360.0) == 0.0
