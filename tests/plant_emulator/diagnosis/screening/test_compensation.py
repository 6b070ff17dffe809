"""One parameter that makes room for an effect, on machines so small that they can be checked."""

import pytest

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.screening.compensation import COMPENSATED, Compensation, compensate
from tests.plant_emulator.diagnosis.line import TIME, Line, linear, noisy
from tests.plant_emulator.diagnosis.screening.late import Late, late_pulses


def test_gain_is_that_at_the_best_size_with_the_slope_moved() -> None:
    """By hand: without a cube of -4, a slope of 3 is fitted as 3 - 4 (3/5) = 0.6.

    Beside a cube of -0.3 the slope rises by 0.3 (3/5). The part of the cube that no slope follows
    has a mean square of 1/7 - 3/25: of 2000 (1/7 - 3/25) (4^2 - 3.7^2) squares half is the gain.
    """
    model = Line([noisy(2.0 + 3.0 * TIME - 4.0 * TIME**3)], ["cube"])
    base = fit_null(model, (0,))
    (found,) = compensate(model, Compensation(base, (0,), ("cube",)))
    assert found.gain == pytest.approx(1000.0 * (1 / 7 - 3 / 25) * (4.0**2 - 3.7**2), rel=0.2)
    (start,) = found.starts.values()
    assert start.values["cube_size"] == pytest.approx(-0.3)
    assert start.values["b"] == pytest.approx(0.6 + 0.3 * 0.6, abs=0.1)


def test_a_parameter_that_its_prior_holds_makes_no_room() -> None:
    """By hand: at a slope of 4 for 0 with a deviation of 0.05 the cost has 80^2 for the prior."""
    model = Line([noisy(4.0 * TIME)], ["wave"])
    model.parameters = (linear("a", 0.0, std=10.0), linear("b", 0.0, std=0.05))
    base = fit_null(model, (0,))
    (found,) = compensate(model, Compensation(base, (0,), ("wave",)))
    assert found.gain < 5.0


@pytest.mark.parametrize("plausible", [0.1, 0.33])
def test_a_delay_that_stood_for_a_filter_makes_room(plausible: float) -> None:
    """The filter delays by 0.1 nearly, and the delay was 0.05 beside it.

    At the plausible size, or at 0.3 of it, no more than the delay's error is left.
    """
    model = Late([noisy(late_pulses(0.05, 0.1))], plausible)
    base = fit(model, (), (0,), {"a": 0.0, "b": 0.15}, [{}])
    (found,) = compensate(model, Compensation(base, (0,), ("lag",)))
    start = found.starts[COMPENSATED]
    assert start.values["lag_size"] == pytest.approx(0.1, abs=0.002)
    assert start.values["b"] == pytest.approx(0.05, abs=0.01)
    assert found.gain > 0.25 * base.cost
