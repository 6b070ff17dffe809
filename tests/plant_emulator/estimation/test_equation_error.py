"""Start values from the equations of motion, on equations that can be solved by hand."""

import numpy as np
import pytest

from plant_emulator.estimation.equation_error import MECHANICAL, least_absolute, start_values
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log


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
    """By hand: doubled deviations cost log 2 for each independent sample."""
    noise, none = np.tile([-1.0, 1.0], 500), np.zeros(0)
    costs = [least_absolute(np.zeros((1000, 0)), k * noise, none, none, 0.1)[1] for k in (1.0, 2.0)]
    assert costs[1] - costs[0] == pytest.approx(100.0 * np.log(2.0))


@pytest.mark.parametrize("precision", [0.0, 1.0])
def test_exact_equations_are_solved(precision: float) -> None:
    """The prior mean is the solution; a column of no effect stays at its mean."""
    matrix = np.column_stack([np.ones(50), np.zeros(50)])
    target, means = np.full(50, 3.0), np.array([3.0, 5.0])
    found, cost = least_absolute(matrix, target, means, np.full(2, precision))
    assert found == pytest.approx([3.0, 5.0])
    assert np.isfinite(cost)


def test_exponent_that_the_equations_do_not_tell_is_that_of_the_prior(
    nominal: ParameterSet,
) -> None:
    """At one speed no exponent fits better than another; 0.45 is the nearest one to 0.4418."""
    time = np.arange(0.0, 20.0, 0.01)
    own, still = nominal.values(), np.zeros_like(time)
    noise = np.random.default_rng(1).normal(scale=0.3, size=len(time))
    friction = own["gear_coulomb_friction"] + own["gear_viscous_friction"] * 3.0**0.4418
    signals = {
        "motor_speed": still + 3.0 * own["gear_ratio"],
        "drum_speed": still + 3.0,
        "shaft_torque": noise - friction / own["gear_ratio"],
    }
    found = start_values([Log(time, signals, "made")], nominal, MECHANICAL)
    assert found["gear_friction_exponent"] == pytest.approx(0.45)
    assert found["gear_coulomb_friction"] == pytest.approx(own["gear_coulomb_friction"], rel=0.1)
