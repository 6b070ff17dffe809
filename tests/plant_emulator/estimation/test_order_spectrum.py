"""Order analysis finds the waves a turn, and takes no noise for a ripple."""

import numpy as np
import pytest

from plant_emulator.estimation.order_spectrum import strongest_ripple


def speeding_up(seconds: float = 40.0) -> np.ndarray:
    """Turns of a part that speeds up from rest to two turns a second, at 100 samples a second."""
    time = np.arange(0.0, seconds, 0.01)
    return time**2 / seconds


def test_wave_of_any_speed_is_found_with_all_its_squares() -> None:
    """A wave of amplitude a holds n a^2 / 2 squares; noise of variance 1 scales them to its own."""
    random, turns = np.random.default_rng(1), speeding_up()
    rows = [
        0.5 * np.cos(2.0 * np.pi * 4.12 * turns + phase) + random.standard_normal(len(turns))
        for phase in (0.3, 2.0)
    ]
    found = strongest_ripple([(turns, row) for row in rows], 0.5, 20.0)
    assert found is not None
    assert found.significant
    assert found.order == pytest.approx(4.12, abs=0.5 / turns[-1])
    squares = sum(len(row) * 0.5**2 / 2.0 / np.mean(row**2) for row in rows)
    assert found.squares == pytest.approx(squares, rel=0.15)


def test_noise_shows_no_ripple_and_its_strongest_order_is_as_large_as_extreme_values_are() -> None:
    """The strongest of n exponentials of mean 1 lies at log n; squares are twice as large.

    80 turns times 20 orders are 1600 independent ones, or somewhat more with the padding.
    """
    random, turns = np.random.default_rng(2), speeding_up(80.0)
    found = [
        strongest_ripple([(turns, random.standard_normal(len(turns)))], 0.5, 20.5)
        for _ in range(200)
    ]
    assert not any(one is None or one.significant for one in found)
    median = np.median([one.squares for one in found if one is not None])
    assert median == pytest.approx(2.0 * (np.log(1600.0) - np.log(np.log(2.0))), abs=2.5)


def test_wave_of_time_is_no_ripple_where_the_speed_changes() -> None:
    random, turns = np.random.default_rng(3), speeding_up()
    time = np.arange(0.0, 40.0, 0.01)
    row = 0.3 * np.sin(2.0 * np.pi * 3.0 * time) + random.standard_normal(len(time))
    found = strongest_ripple([(turns, row)], 0.5, 20.0)
    assert found is not None
    assert not found.significant


def test_run_that_hardly_turns_shows_nothing() -> None:
    turns = np.linspace(0.0, 1.5, 500)
    assert strongest_ripple([(turns, np.ones(500))], 0.5, 20.0) is None
    assert strongest_ripple([(np.zeros(500), np.ones(500))], 0.5, 20.0) is None
    assert strongest_ripple([(np.zeros(0), np.zeros(0))], 0.5, 20.0) is None
