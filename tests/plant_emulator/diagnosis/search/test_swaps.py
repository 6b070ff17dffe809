"""Where a fit with another effect in the place of one begins."""

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.search.confirmation import Reduction
from plant_emulator.diagnosis.search.swaps import swaps
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, noisy


def test_effect_that_explains_half_of_another_one_begins_in_its_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By hand: beside a constant t^2 has 15 / 16 of the variance of |t| in common, t^3 nothing.

    A wave of 4 stays. The data hold a kink of 5: columns of 0.3 have a gram of 2000 0.3^2 / 12, and
    the prior shrinks it by a sixteenth.
    """
    monkeypatch.setitem(SHAPES, "bowl", np.square)
    y = noisy(2.0 + 3.0 * TIME + 5.0 * abs(TIME) + 4.0 * np.sin(20.0 * TIME))
    model = Line([y], ("kink", "bowl", "cube", "wave"))
    start = {"a": 0.0, "b": 0.0, "bowl_size": 1.0, "wave_size": 1.0}
    base = fit(model, ("bowl", "wave"), (0,), start, [{}])
    (found,) = swaps(model, Reduction(base, (0,), "bowl"))
    assert found.effects == ("kink", "wave")
    assert found.values["bowl_size"] == 0.0
    assert found.values["kink_size"] == pytest.approx(5.0 * 15 / 16, abs=0.15)
    assert found.values["wave_size"] == pytest.approx(4.0, abs=0.2)
    assert found.values["a"] == pytest.approx(2.0, abs=0.3)
    assert swaps(model, Reduction(base, (0,), "wave")) == []


@pytest.mark.parametrize(("aside", "takes"), [(0.3, True), (0.5, False)])
def test_effect_that_explains_less_than_half_takes_no_place(
    aside: float, takes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: |t| has 1 / 12, a wave beside it a^2 / 2: 0.65 of the variance is common, or 0.4."""
    monkeypatch.setitem(SHAPES, "curl", lambda x: np.abs(x) + aside * np.sin(9.0 * x))
    model = Line([noisy(2.0 + 3.0 * TIME + 5.0 * abs(TIME))], ("kink", "curl"))
    base = fit(model, ("kink",), (0,), {"a": 0.0, "b": 0.0, "kink_size": 1.0}, [{}])
    found = swaps(model, Reduction(base, (0,), "kink"))
    assert [one.effects for one in found] == ([("curl",)] if takes else [])


def test_no_other_effect_takes_the_place_of_one_that_explains_nothing() -> None:
    """The cube has what noise gives it; the wave would gain as little."""
    model = Line([noisy(2.0 + 3.0 * TIME)], ("cube", "wave"))
    base = fit(model, ("cube",), (0,), {"a": 0.0, "b": 0.0, "cube_size": 1.0}, [{}])
    assert swaps(model, Reduction(base, (0,), "cube")) == []
