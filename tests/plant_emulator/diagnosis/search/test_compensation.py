"""One parameter that makes room for an effect, on machines so small that they can be checked."""

from dataclasses import replace

import pytest

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.search.compensation import start_with_room
from tests.plant_emulator.diagnosis.line import TIME, Line, linear, noisy
from tests.plant_emulator.diagnosis.search.late import Late, late_pulses


def absent(base: FitResult, effect: str) -> FitResult:
    """A fit with an effect that it has none of."""
    values = {**base.values, f"{effect}_size": 0.0}
    return replace(base, effects=(effect,), values=values)


def test_slope_is_moved_beside_the_best_size() -> None:
    """By hand: without a cube of -4, a slope of 3 is fitted as 3 - 4 (3/5) = 0.6.

    Beside a cube of -0.3 the slope rises by 0.3 (3/5).
    """
    model = Line([noisy(2.0 + 3.0 * TIME - 4.0 * TIME**3)], ["cube"])
    base = fit_null(model, (0,))
    start = start_with_room(model, absent(base, "cube"), (0,), base)
    assert start.values["cube_size"] == pytest.approx(-0.3)
    assert start.values["b"] == pytest.approx(0.6 + 0.3 * 0.6, abs=0.1)


def test_a_parameter_that_its_prior_holds_makes_no_room() -> None:
    """By hand: 2000 samples hold a slope of 4 as well as a deviation of sqrt(3 / 2000) = 0.039.

    A prior of 0 with a deviation of 0.05 draws it to 4 (0.05^2 / (0.05^2 + 0.039^2)) = 2.5.
    """
    model = Line([noisy(4.0 * TIME)], ["wave"])
    model.parameters = (linear("a", 0.0, std=10.0), linear("b", 0.0, std=0.05))
    base = fit_null(model, (0,))
    start = start_with_room(model, absent(base, "wave"), (0,), base)
    assert start.values["b"] == pytest.approx(2.5, abs=0.3)


@pytest.mark.parametrize("plausible", [0.1, 0.33])
def test_a_delay_that_stood_for_a_filter_makes_room(plausible: float) -> None:
    """The filter delays by 0.1 nearly, and the delay was 0.05 beside it.

    It is tried at the plausible size and at 0.3 of it.
    """
    model = Late([noisy(late_pulses(0.05, 0.1))], plausible)
    base = fit(model, (), (0,), {"a": 0.0, "b": 0.15}, [{}])
    start = start_with_room(model, absent(base, "lag"), (0,), base)
    assert start.values["lag_size"] == pytest.approx(0.1, abs=0.002)
    assert start.values["b"] == pytest.approx(0.05, abs=0.01)
