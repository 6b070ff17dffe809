"""Effects that only correct the law of another one, against hand calculations."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.decision.verdict import decide
from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.search.summary import corrections
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, explained, noisy


@pytest.mark.parametrize(
    ("costs", "found"),
    [
        ({"kink": 1_000_100.0, "wave": 10_000.0}, {"wave"}),
        ({"kink": 1_000_100.0, "wave": 10_200.0}, set()),  # 10100 of 1000000
        ({"kink": 160.0, "wave": 150.0}, set()),  # each nearly does without the other
        # The large one is exact, and of another subsystem.
        ({"cube": 1_000_100.0, "kink": 6_100.0, "wave": 5_100.0}, set()),
    ],
)
def test_a_correction_closes_less_than_the_law_may_leave(
    costs: dict[str, float], found: set[str]
) -> None:
    """By hand, of a set that costs 100: a law may leave a hundredth of what it closes."""
    model = Line([noisy(TIME)], list(costs))
    library = {n: replace(c, subsystem="load") for n, c in model.candidates.items()}
    if "cube" in library:
        library["cube"] = replace(library["cube"], exact_form=True, subsystem="supply")
    final = replace(fit_null(model, [0]), effects=tuple(costs), cost=100.0)
    assert corrections(library, final, costs) == found


@pytest.mark.parametrize(
    ("exact", "share", "named"),
    [(False, True, ("late",)), (False, False, ("late", "wave")), (True, True, ("late", "wave"))],
)
def test_an_effect_of_the_same_subsystem_may_only_correct_the_law(
    monkeypatch: pytest.MonkeyPatch, exact: bool, share: bool, named: tuple[str, ...]
) -> None:
    """By hand: 2250 squares of the wave are less than a hundredth of the 900000 of the other."""
    monkeypatch.setitem(SHAPES, "late", lambda x: (x > 0.0) * np.sin(31.0 * x))
    monkeypatch.setitem(SHAPES, "wave", lambda x: (x < 0.0) * np.sin(20.0 * x))
    measured = 30.0 * SHAPES["late"](TIME) + 1.5 * SHAPES["wave"](TIME)
    model = Line([noisy(measured, 0), noisy(measured, 1)], ["late", "wave"])
    late, wave = model.candidates["late"], model.candidates["wave"]
    model.candidates = {
        "late": replace(late, exact_form=exact, subsystem="load"),
        "wave": replace(wave, subsystem="load" if share else "supply"),
    }
    found = explained(model)
    assert found.final.effects == ("late", "wave")
    assert found.named == named
    assert decide(model, found).effects == named
    assert found.classes() == [[name] for name in named]
    assert (found.trace[-1].action == "others only correct a law") == (named == ("late",))
