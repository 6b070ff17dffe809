"""The scoring of labelled cases, by answers made by hand."""

from pathlib import Path
from typing import Any

import pytest

from tools.practice import Case, cases_of, is_located, right

TWO = Case(
    name="two",
    effects=frozenset({"stribeck", "torque_sensor_lag"}),
    kind="effect",
    places=frozenset({"gear", "torque_sensor"}),
)
NONE = Case(name="none", effects=frozenset(), kind="none", places=frozenset())


def answer(kind: str, *classes: list[str], place: str | None = None, left: float = 1.0) -> Any:
    """An answer that names the first of each class."""
    return {
        "verdict": {"kind": kind, "class": list(classes), "effects": [c[0] for c in classes]},
        "location": {"subsystem": place},
        "gap": {"explained": {"torque": left}, "noise_floor": {"torque": 1.0}},
    }


def test_labels_are_read_with_their_places(tmp_path: Path) -> None:
    text = "case\tlabel\tkind\tsubsystem\none\ta+b\teffect\tgear|drum\ntwo\tdrift\tparameter\t\n"
    (tmp_path / "labels.tsv").write_text(text, encoding="utf-8")
    one, two = cases_of(tmp_path)
    assert (one.effects, one.places) == ({"a", "b"}, {"gear", "drum"})
    assert (two.effects, two.kind, two.places) == (frozenset(), "parameter", frozenset())


@pytest.mark.parametrize(
    ("case", "given", "expected"),
    [
        (TWO, answer("effect", ["torque_sensor_lag", "shaft_damping"], ["stribeck"]), True),
        (TWO, answer("effect", ["torque_sensor_lag"]), False),
        (TWO, answer("effect", ["torque_sensor_lag"], ["stribeck"], ["field_lag"]), False),
        (TWO, answer("effect", ["torque_sensor_lag"], ["stribeck", "a", "b", "c"]), False),
        (TWO, answer("unknown"), False),
        (NONE, answer("none"), True),
        (NONE, answer("effect", ["stribeck"]), False),
    ],
)
def test_answer_is_right_if_every_effect_is_in_a_small_class_and_no_more(
    case: Case, given: Any, expected: bool
) -> None:
    assert right(case, given, withheld=False) is expected


def test_withheld_effect_is_unknown_or_another_that_leaves_noise() -> None:
    assert right(TWO, answer("unknown", left=9.0), withheld=True)
    assert right(TWO, answer("effect", ["field_lag"], left=1.1), withheld=True)
    assert not right(TWO, answer("effect", ["field_lag"], left=1.3), withheld=True)
    assert not right(TWO, answer("parameter"), withheld=True)


def test_place_is_one_of_the_labels_or_none_is_asked_for() -> None:
    assert is_located(TWO, answer("effect", place="torque_sensor"))
    assert not is_located(TWO, answer("effect", place="drum"))
    assert is_located(NONE, answer("none"))
