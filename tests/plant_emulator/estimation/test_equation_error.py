"""Start values from the equations of motion, on equations that can be solved by hand."""

import numpy as np
import pytest

from plant_emulator.estimation.equation_error import least_absolute


@pytest.mark.parametrize(("precision", "value"), [(0.0, 1.0), (1e6, 0.0)])
def test_spikes_count_little_and_the_prior_as_much_as_it_is_sure(
    precision: float, value: float
) -> None:
    """By hand: the least absolute deviation of a constant is the median."""
    target = np.where(np.arange(300) % 3 == 0, 50.0, 1.0)
    found, _ = least_absolute(np.ones((300, 1)), target, np.array([0.0]), np.array([precision]))
    assert found[0] == pytest.approx(value, abs=0.01)


def test_priors_share_out_what_the_equations_do_not_tell_apart() -> None:
    """By hand: x + y = 3 beside means of 1: the 1 that lacks is shared as 0.1^2 to 0.2^2."""
    found, _ = least_absolute(
        np.ones((100, 2)), np.full(100, 3.0), np.array([1.0, 1.0]), np.array([10.0, 5.0])
    )
    assert found == pytest.approx([1.2, 1.8], abs=0.01)


def test_density_falls_with_the_deviations() -> None:
    """By hand: doubled deviations cost n share log 2. A column of no effect stays at its mean."""
    noise = np.tile([-1.0, 1.0], 500)
    none = np.zeros((1000, 0))
    costs = [least_absolute(none, k * noise, np.zeros(0), np.zeros(0))[1] for k in (1.0, 2.0)]
    assert costs[1] - costs[0] == pytest.approx(1000 * 0.0625 * np.log(2.0))
    silent = np.zeros((1000, 1))
    found, cost = least_absolute(silent, noise, np.array([3.0]), np.array([1.0]))
    assert (found[0], cost) == (pytest.approx(3.0), pytest.approx(costs[0]))
