"""What counts as right."""

from typing import Any

import pytest

from plant_emulator.blind import summary, table
from plant_emulator.blind.score import Unsealed, confusion, detail, false_alarm, located, right
from plant_emulator.effects import Effect
from tests.plant_emulator.blind.conftest import case_with, hidden

OFFSET = hidden("torque_sensor_offset", "torque_sensor", offset=0.5)
LAG = hidden("drum_speed_lag", "speed_sensor", time_constant=0.05)
RIPPLE = hidden("torque_ripple", "motor", outside=True, amplitude=0.02)


def answer(
    kind: str, *effects: str, classes: list[list[str]] | None = None, place: str | None = None,
    value: float = 0.52, error: float = 0.02,
) -> dict[str, Any]:  # fmt: skip
    one = {"name": "offset", "value": value, "standard_error": error, "unit": "N m"}
    ranking = [
        {"effect": name, "evidence": 100.0 - k, "parameters": [one]}
        for k, name in enumerate(dict.fromkeys([*effects, "stribeck"]))
    ]
    return {
        "verdict": {
            "kind": kind, "effects": list(effects), "confidence": 0.9,
            "class": classes or [[name] for name in effects],
        },
        "location": {"subsystem": place},
        "gap": {"closed_fraction": 0.97, "closed_fraction_ci95": [0.95, 0.99]},
        "ranking": ranking,
    }  # fmt: skip


def unsealed(
    found: dict[str, Any] | None, *effects: Any, kind: str = "effect", norm: float = 50.0
) -> Unsealed:
    norms = {h.effect: norm for h in effects}
    return Unsealed(case=case_with(*effects, kind=kind), norms=norms, answer=found, closed=0.96)


@pytest.mark.parametrize(
    ("kind", "verdict", "holds"),
    [
        ("none", "none", True), ("none", "parameter", False), ("drift", "parameter", True),
        ("drift", "none", False), ("drift", "unknown", False),
    ],
)  # fmt: skip
def test_without_effect_only_its_own_verdict_is_right(kind: str, verdict: str, holds: bool) -> None:
    assert right(unsealed(answer(verdict), kind=kind)) is holds


@pytest.mark.parametrize(
    ("verdict", "alarm"), [("effect", True), ("unknown", True), ("parameter", False)]
)
def test_claimed_cause_or_gap_on_drift_is_a_false_alarm(verdict: str, alarm: bool) -> None:
    named = ["stribeck"] if verdict == "effect" else []
    assert false_alarm(unsealed(answer(verdict, *named), kind="drift")) is alarm


def test_effect_by_its_name_is_right() -> None:
    assert right(unsealed(answer("effect", "torque_sensor_offset"), OFFSET))


def test_another_name_is_wrong() -> None:
    assert not right(unsealed(answer("effect", "stribeck"), OFFSET))


def test_another_name_of_its_class_is_right_but_not_first() -> None:
    classes = [["torque_sensor_drift", "torque_sensor_offset"]]
    one = unsealed(answer("effect", "torque_sensor_drift", classes=classes), OFFSET)
    assert right(one)
    assert not detail(one, {})["top1"]


def test_class_of_four_is_no_answer() -> None:
    classes = [["stribeck", "presliding", "field_lag", "torque_sensor_offset"]]
    assert not right(unsealed(answer("effect", "stribeck", classes=classes), OFFSET))


def test_one_name_too_many_is_wrong() -> None:
    assert not right(unsealed(answer("effect", "torque_sensor_offset", "stribeck"), OFFSET))


def test_two_effects_are_both_asked_for() -> None:
    both = answer("effect", "drum_speed_lag", "torque_sensor_offset")
    assert right(unsealed(both, OFFSET, LAG, kind="two"))
    assert not right(unsealed(answer("effect", "drum_speed_lag"), OFFSET, LAG, kind="two"))


def test_one_class_does_not_stand_for_two_effects() -> None:
    names = ["drum_speed_lag", "torque_sensor_offset"]
    found = answer("effect", "drum_speed_lag", "stribeck", classes=[names, ["stribeck"]])
    assert not right(unsealed(found, OFFSET, LAG, kind="two"))


@pytest.mark.parametrize(
    ("found", "holds"),
    [
        (answer("parameter"), True), (answer("none"), True), (answer("unknown"), False),
        (answer("effect", "stribeck"), False), (answer("effect", "torque_sensor_offset"), True),
    ],
)  # fmt: skip
def test_what_cannot_be_detected_need_not_be_but_no_other_named(
    found: dict[str, Any], holds: bool
) -> None:
    assert right(unsealed(found, OFFSET, norm=3.0)) is holds


@pytest.mark.parametrize(
    ("found", "holds"),
    [(answer("unknown"), True), (answer("effect", "stribeck"), False), (answer("none"), False)],
)
def test_outside_the_library_unknown_is_right(found: dict[str, Any], holds: bool) -> None:
    assert right(unsealed(found, RIPPLE, kind="outside")) is holds


def test_place_is_that_of_one_of_the_hidden() -> None:
    assert located(unsealed(answer("unknown", place="motor"), RIPPLE, kind="outside"))
    assert not located(unsealed(answer("unknown", place="gear"), RIPPLE, kind="outside"))


def test_failed_diagnosis_is_wrong_and_told(known: dict[str, Effect]) -> None:
    found = detail(unsealed(None, OFFSET), known)
    assert (found["right"], found["verdict"], found["evidence"]) == (False, "failed", None)


def test_size_is_covered_within_two_standard_errors(known: dict[str, Effect]) -> None:
    def covered(value: float) -> bool:
        found = answer("effect", "torque_sensor_offset", value=value)
        [size] = detail(unsealed(found, OFFSET), known)["sizes"]
        assert size["same_law"]
        return bool(size["covered"])

    assert covered(0.53)
    assert not covered(0.55)


def test_evidence_is_that_of_the_weakest_name(known: dict[str, Effect]) -> None:
    found = answer("effect", "drum_speed_lag", "torque_sensor_offset")
    assert detail(unsealed(found, OFFSET, LAG, kind="two"), known)["evidence"] == 99.0


@pytest.fixture
def details(known: dict[str, Effect]) -> list[dict[str, Any]]:
    cases = [
        unsealed(answer("none"), kind="none"),
        unsealed(answer("effect", "stribeck"), kind="drift"),
        unsealed(answer("effect", "torque_sensor_offset", place="torque_sensor"), OFFSET),
        unsealed(answer("effect", "stribeck", place="gear"), OFFSET),
        unsealed(answer("unknown", place="motor"), RIPPLE, kind="outside"),
    ]
    return [{**detail(case, known), "seconds": 1.0, "error": ""} for case in cases]


def test_answer_counts_what_its_schema_names(details: list[dict[str, Any]]) -> None:
    found = summary.answer(details, 1, "m", "p")
    names = ("cases", "correct", "false_alarms", "unknown_recognised", "location_correct")
    assert [found[name] for name in names] == [5, 3, 1, 1, 2]
    assert found["schema"] == "blind-trial/1"
    assert found["shares"]["detectable effects, class"]["share"] == 0.5
    assert found["shrinkage_error"]["median"] == pytest.approx(0.01)


def test_confusion_has_a_row_for_every_truth(details: list[dict[str, Any]]) -> None:
    assert confusion(details) == {
        "drift": {"stribeck": 1},
        "none": {"none": 1},
        "outside: torque_ripple": {"unknown": 1},
        "torque_sensor_offset": {"stribeck": 1, "torque_sensor_offset": 1},
    }


def test_terminal_names_every_wrong_case(details: list[dict[str, Any]]) -> None:
    text = "\n".join(summary.lines(details, 1))
    assert "torque_sensor_offset (norm 50) answered as stribeck in gear" in text
    assert "drift answered as stribeck" in text
    assert text.count("answered as") == 2


def test_spreadsheet_has_a_line_a_case_and_calibration_a_pair_an_answer(
    details: list[dict[str, Any]],
) -> None:
    assert len(table.cases(details).splitlines()) == 6
    assert table.evidence(details).splitlines()[:3] == [
        "kind,evidence,right", "none,100.0,True", "effect,100.0,False",
    ]  # fmt: skip
