"""Score and summary of a trial: which answers are right."""

import json
from typing import Any

import pytest

from plant_emulator.blind import table
from plant_emulator.blind.result import CaseResult, result_from
from plant_emulator.blind.score import Unsealed, is_false_alarm, is_located, is_right, score
from plant_emulator.blind.summary import TrialAnswer, confusion
from plant_emulator.diagnosis.answer import (
    Answer,
    HeldOutGap,
    Kind,
    Location,
    Logs,
    Quantity,
    RankedEffect,
    Verdict,
)
from plant_emulator.effects import Effect
from tests.plant_emulator.blind.conftest import case_with, hidden

OFFSET = hidden("torque_sensor_offset", "torque_sensor", offset=0.5)
LAG = hidden("drum_speed_lag", "speed_sensor", time_constant=0.05)
RIPPLE = hidden("torque_ripple", "motor", outside=True, amplitude=0.02)


def answer(
    kind: Kind, *effects: str, classes: list[list[str]] | None = None, place: str | None = None,
    value: float = 0.52, error: float = 0.02,
) -> Answer:  # fmt: skip
    """The answer of a diagnosis with this verdict and fault location."""
    one = Quantity(name="offset", value=value, standard_error=error, unit="N m")
    ranking = [
        RankedEffect(
            effect=name, subsystem="", evidence=100.0 - k, held_out_gain=None, parameters=(one,),
            accepted=name in effects,
        )
        for k, name in enumerate(dict.fromkeys([*effects, "stribeck"]))
    ]  # fmt: skip
    verdict = Verdict(
        kind=kind, effects=effects, confidence=0.9, parameters=(), statement="",
        classes=tuple(map(tuple, classes or [[name] for name in effects])), next_experiment=None,
        log_odds=12.0,
    )  # fmt: skip
    gap = HeldOutGap(
        nominal={}, recalibrated={}, explained={}, noise_floor={}, closed_fraction=0.97,
        closed_fraction_ci95=(0.95, 0.99),
    )  # fmt: skip
    return Answer(
        logs=Logs(estimation=(), held_out=()),
        verdict=verdict,
        location=Location(subsystem=place, channel=None, phase=None, shares={}, cells=()),
        gap=gap,
        ranking=tuple(ranking),
        undetectable=(),
    )


def unsealed(
    found: Answer | None, *effects: Any, kind: str = "effect", norm: float = 50.0
) -> Unsealed:
    norms = {h.effect: norm for h in effects}
    return Unsealed(case=case_with(*effects, kind=kind), norms=norms, answer=found, closed=0.96)


@pytest.mark.parametrize(
    ("kind", "verdict", "holds"),
    [
        ("none", "none", True), ("none", "parameter", False), ("deviation", "parameter", True),
        ("deviation", "none", False), ("deviation", "unknown", False),
    ],
)  # fmt: skip
def test_without_effect_only_its_own_verdict_is_right(
    kind: str, verdict: Kind, holds: bool
) -> None:
    assert is_right(unsealed(answer(verdict), kind=kind)) is holds


@pytest.mark.parametrize(
    ("verdict", "alarm"), [("effect", True), ("unknown", True), ("parameter", False)]
)
def test_claimed_cause_of_parameter_deviations_is_a_false_alarm(verdict: Kind, alarm: bool) -> None:
    named = ["stribeck"] if verdict == "effect" else []
    assert is_false_alarm(unsealed(answer(verdict, *named), kind="deviation")) is alarm


def test_effect_by_its_name_is_right() -> None:
    assert is_right(unsealed(answer("effect", "torque_sensor_offset"), OFFSET))


def test_another_name_is_wrong() -> None:
    assert not is_right(unsealed(answer("effect", "stribeck"), OFFSET))


def test_another_name_of_its_class_is_right_but_not_first() -> None:
    classes = [["torque_sensor_drift", "torque_sensor_offset"]]
    one = unsealed(answer("effect", "torque_sensor_drift", classes=classes), OFFSET)
    assert is_right(one)
    assert not score(one, {}).top1


def test_class_of_four_is_no_answer() -> None:
    classes = [["stribeck", "presliding", "field_lag", "torque_sensor_offset"]]
    assert not is_right(unsealed(answer("effect", "stribeck", classes=classes), OFFSET))


def test_one_name_too_many_is_wrong() -> None:
    assert not is_right(unsealed(answer("effect", "torque_sensor_offset", "stribeck"), OFFSET))


def test_two_effects_are_both_asked_for() -> None:
    both = answer("effect", "drum_speed_lag", "torque_sensor_offset")
    assert is_right(unsealed(both, OFFSET, LAG, kind="two"))
    assert not is_right(unsealed(answer("effect", "drum_speed_lag"), OFFSET, LAG, kind="two"))


def test_one_class_does_not_stand_for_two_effects() -> None:
    names = ["drum_speed_lag", "torque_sensor_offset"]
    found = answer("effect", "drum_speed_lag", "stribeck", classes=[names, ["stribeck"]])
    assert not is_right(unsealed(found, OFFSET, LAG, kind="two"))


@pytest.mark.parametrize(
    ("found", "holds"),
    [
        (answer("parameter"), True), (answer("none"), True), (answer("unknown"), False),
        (answer("effect", "stribeck"), False), (answer("effect", "torque_sensor_offset"), True),
    ],
)  # fmt: skip
def test_what_cannot_be_detected_need_not_be_but_no_other_named(found: Answer, holds: bool) -> None:
    assert is_right(unsealed(found, OFFSET, norm=3.0)) is holds


@pytest.mark.parametrize(
    ("found", "holds"),
    [(answer("unknown"), True), (answer("effect", "stribeck"), False), (answer("none"), False)],
)
def test_outside_the_library_unknown_is_right(found: dict[str, Any], holds: bool) -> None:
    assert is_right(unsealed(found, RIPPLE, kind="outside")) is holds


def test_place_is_that_of_one_of_the_hidden() -> None:
    assert is_located(unsealed(answer("unknown", place="motor"), RIPPLE, kind="outside"))
    assert not is_located(unsealed(answer("unknown", place="gear"), RIPPLE, kind="outside"))


def test_failed_diagnosis_is_wrong_and_counted(all_effects: dict[str, Effect]) -> None:
    found = score(unsealed(None, OFFSET), all_effects)
    assert (found.right, found.verdict, found.evidence) == (False, "failed", None)


def test_size_is_covered_within_two_standard_errors(all_effects: dict[str, Effect]) -> None:
    def covered(value: float) -> bool:
        found = answer("effect", "torque_sensor_offset", value=value)
        [size] = score(unsealed(found, OFFSET), all_effects).sizes
        assert size.same_law
        return size.covered

    assert covered(0.53)
    assert not covered(0.55)


def test_evidence_is_that_of_the_weakest_name(all_effects: dict[str, Effect]) -> None:
    found = answer("effect", "drum_speed_lag", "torque_sensor_offset")
    assert score(unsealed(found, OFFSET, LAG, kind="two"), all_effects).evidence == 99.0


@pytest.fixture
def results(all_effects: dict[str, Effect]) -> tuple[CaseResult, ...]:
    cases = [
        unsealed(answer("none"), kind="none"),
        unsealed(answer("effect", "stribeck"), kind="deviation"),
        unsealed(answer("effect", "torque_sensor_offset", place="torque_sensor"), OFFSET),
        unsealed(answer("effect", "stribeck", place="gear"), OFFSET),
        unsealed(answer("unknown", place="motor"), RIPPLE, kind="outside"),
    ]
    return tuple(score(case, all_effects, seconds=1.0) for case in cases)


@pytest.fixture
def trial(results: tuple[CaseResult, ...]) -> TrialAnswer:
    return TrialAnswer(results=results, seed=1, manifest_sha256="m", program_sha256="p")


def test_answer_counts_what_its_schema_names(trial: TrialAnswer) -> None:
    found = trial.to_json()
    names = ("cases", "correct", "false_alarms", "unknown_recognised", "location_correct")
    assert [found[name] for name in names] == [5, 3, 1, 1, 2]
    assert found["schema"] == "blind-trial/1"
    assert found["shares"]["detectable effects, class"]["share"] == 0.5
    assert found["shrinkage_error"]["median"] == pytest.approx(0.01)


def test_detail_of_a_case_has_the_keys_of_its_schema(results: tuple[CaseResult, ...]) -> None:
    assert list(results[2].to_json()) == [
        "case", "kind", "truth", "hidden", "programs", "detectable", "verdict", "effects", "class",
        "answered", "evidence", "confidence", "right", "top1", "false_alarm", "subsystem",
        "located", "closed_fraction", "closed_fraction_ci95", "closed_fraction_true", "sizes",
        "seconds", "error", "dirt", "log_odds",
    ]  # fmt: skip


def test_result_survives_json(results: tuple[CaseResult, ...]) -> None:
    for one in results:
        assert result_from(json.loads(json.dumps(one.to_json()))) == one


def test_confusion_has_a_row_for_every_truth(results: tuple[CaseResult, ...]) -> None:
    assert confusion(results) == {
        "deviation": {"stribeck": 1},
        "none": {"none": 1},
        "outside: torque_ripple": {"unknown": 1},
        "torque_sensor_offset": {"stribeck": 1, "torque_sensor_offset": 1},
    }


def test_terminal_names_every_wrong_case(trial: TrialAnswer) -> None:
    text = str(trial)
    assert "torque_sensor_offset (norm 50) answered as stribeck in gear" in text
    assert "deviation answered as stribeck" in text
    assert text.count("answered as") == 2


def test_spreadsheet_has_a_line_a_case_and_calibration_a_pair_an_answer(
    results: tuple[CaseResult, ...],
) -> None:
    assert len(table.cases(results).splitlines()) == 6
    assert table.evidence_table(results).splitlines()[:3] == [
        "kind,log_odds,right", "none,12.0,True", "effect,12.0,False",
    ]  # fmt: skip
