"""The gain that the error of an approximate law can feign, against hand calculations."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.decision.verdict import decide
from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.search.law_error import feigned_gain
from plant_emulator.diagnosis.search.summary import corrections
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, explained, noisy


@pytest.mark.parametrize(
    ("closed", "more", "gain"),
    [
        ([20.0, 0.0], [3.0, 4.0], 0.5 * 0.01 * (20.0 * 3.0) ** 2 / 25.0),
        ([-20.0, 10.0], [3.0, 4.0], 0.5 * 0.01 * (20.0 * 3.0 + 10.0 * 4.0) ** 2 / 25.0),
        ([30.0, 40.0], [3.0, 4.0], 0.5 * 0.01 * 2500.0),  # the same shape: all that is allowed
        ([30.0, 0.0], [0.0, 4.0], 0.0),
        ([30.0, 0.0], [0.0, 0.0], 0.0),
    ],
)
def test_gain_by_hand(closed: list[float], more: list[float], gain: float) -> None:
    assert feigned_gain(np.array(closed), np.array(more), 0.1) == pytest.approx(gain)


@pytest.mark.parametrize(
    ("ripples", "named"), [(TIME > 0.0, {"late"}), (TIME < 0.0, {"late", "wave"})]
)
def test_an_effect_where_the_law_does_not_act_needs_no_more(
    monkeypatch: pytest.MonkeyPatch, ripples: object, named: set[str]
) -> None:
    """By hand: the late effect takes 1000 * 30^2 / 2 from the squares, of which a law that is wrong
    by a tenth leaves 4500. A ripple of 1.5 over half of the samples takes 1125, and acts either
    where the late effect does, or where it does not.
    """
    monkeypatch.setitem(SHAPES, "late", lambda x: (x > 0.0) * np.sin(31.0 * x))
    monkeypatch.setitem(SHAPES, "wave", lambda x: ripples * np.sin(20.0 * x))
    measured = 30.0 * SHAPES["late"](TIME) + 1.5 * SHAPES["wave"](TIME)
    model = Line([noisy(measured)], ["late", "wave"])
    assert set(explained(model).final.effects) == named


@pytest.mark.parametrize(
    ("costs", "found"),
    [
        ({"kink": 1_000_100.0, "wave": 10_000.0}, {"wave"}),
        ({"kink": 1_000_100.0, "wave": 10_200.0}, set()),  # 10100 of 1000000
        ({"kink": 160.0, "wave": 150.0}, set()),  # each nearly does without the other
        # The large one is exact, and changes another quantity.
        ({"cube": 1_000_100.0, "kink": 6_100.0, "wave": 5_100.0}, set()),
    ],
)
def test_a_correction_closes_less_than_the_law_may_leave(
    costs: dict[str, float], found: set[str]
) -> None:
    """By hand, of a set that costs 100: a law may leave a hundredth of what it closes."""
    model = Line([noisy(TIME)], list(costs))
    library = {n: replace(c, quantities=frozenset(["load"])) for n, c in model.candidates.items()}
    if "cube" in library:
        library["cube"] = replace(library["cube"], exact_form=True, quantities=frozenset(["speed"]))
    final = replace(fit_null(model, [0]), effects=tuple(costs), cost=100.0)
    assert corrections(library, final, costs) == found


@pytest.mark.parametrize(
    ("exact", "share", "named"),
    [(False, True, ("late",)), (False, False, ("late", "wave")), (True, True, ("late", "wave"))],
)
def test_an_effect_of_the_same_quantity_may_only_correct_the_law(
    monkeypatch: pytest.MonkeyPatch, exact: bool, share: bool, named: tuple[str, ...]
) -> None:
    """By hand: 1125 squares of the wave are less than a hundredth of the 450000 of the other."""
    monkeypatch.setitem(SHAPES, "late", lambda x: (x > 0.0) * np.sin(31.0 * x))
    monkeypatch.setitem(SHAPES, "wave", lambda x: (x < 0.0) * np.sin(20.0 * x))
    measured = 30.0 * SHAPES["late"](TIME) + 1.5 * SHAPES["wave"](TIME)
    model = Line([noisy(measured)], ["late", "wave"])
    late, wave = model.candidates["late"], model.candidates["wave"]
    own = frozenset(["load"] if share else ["supply"])
    model.candidates = {
        "late": replace(late, exact_form=exact, quantities=frozenset(["load", "speed"])),
        "wave": replace(wave, quantities=own),
    }
    found = explained(model)
    assert found.final.effects == ("late", "wave")
    assert found.named == named
    assert decide(model, found).effects == named
    assert found.classes() == [[name] for name in named]
    assert (found.trace[-1].action == "others only correct a law") == (named == ("late",))
