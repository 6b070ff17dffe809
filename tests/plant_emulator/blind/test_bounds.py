"""Clopper-Pearson bounds against published figures and the binomial distribution."""

import pytest
from scipy.stats import binom

from plant_emulator.blind.bounds import HitRate, clopper_pearson, share_of


def test_no_error_in_sixty_leaves_less_than_5_percent() -> None:
    """1 - 0.05^(1/60)."""
    lower, upper = clopper_pearson(0, 60)
    assert lower == 0.0
    assert upper == pytest.approx(0.0487, abs=5e-5)


def test_28_of_29_is_82_to_99_9_percent_two_sided() -> None:
    lower, upper = clopper_pearson(28, 29, tail=0.025)
    assert (lower, upper) == (pytest.approx(0.822, abs=1e-3), pytest.approx(0.9991, abs=1e-4))


@pytest.mark.parametrize(("hits", "of"), [(1, 4), (7, 20), (57, 60)])
def test_bounds_are_where_the_tails_hold_5_percent(hits: int, of: int) -> None:
    lower, upper = clopper_pearson(hits, of)
    assert binom.sf(hits - 1, of, lower) == pytest.approx(0.05)
    assert binom.cdf(hits, of, upper) == pytest.approx(0.05)


def test_nothing_counted_says_nothing() -> None:
    assert clopper_pearson(0, 0) == (0.0, 1.0)
    assert HitRate(0, 0).to_json()["share"] is None


def test_share_counts_what_is_true() -> None:
    assert share_of([True, False, True]) == HitRate(2, 3)
