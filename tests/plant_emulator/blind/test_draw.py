"""The draw of the hidden cases."""

import json
from collections import Counter

import numpy as np
import pytest

from plant_emulator.blind.case import Case, case_of
from plant_emulator.blind.catalogue import INSIDE
from plant_emulator.blind.draw import PROGRAMS as ALWAYS
from plant_emulator.blind.draw import draw, kinds
from plant_emulator.effects import Effect
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram


@pytest.fixture(scope="module")
def cases(nominal: ParameterSet, all_effects: dict[str, Effect]) -> list[Case]:
    return [draw(3, number, nominal, all_effects) for number in range(80)]


def test_a_quarter_of_the_cases_hides_no_effect() -> None:
    counted = Counter(kinds(1, 80))
    assert counted["none"] + counted["deviation"] == 20
    assert counted == {"none": 8, "deviation": 12, "effect": 40, "two": 8, "outside": 12}


def test_more_cases_begin_with_the_same() -> None:
    assert kinds(5, 80)[:33] == kinds(5, 33)


def test_a_seed_and_a_number_are_always_the_same_case(
    nominal: ParameterSet, all_effects: dict[str, Effect], cases: list[Case]
) -> None:
    assert draw(3, 17, nominal, all_effects) == cases[17]
    assert draw(4, 17, nominal, all_effects) != cases[17]


def test_every_effect_comes_up_in_40_single_cases(cases: list[Case]) -> None:
    single = Counter(c.hidden[0].effect for c in cases if c.kind == "effect")
    assert set(single) == {entry.effect for entry in INSIDE}
    assert max(single.values()) <= 2


def test_case_survives_json(cases: list[Case]) -> None:
    assert all(case_of(json.loads(json.dumps(case.to_json()))) == case for case in cases)


def test_sizes_are_half_to_twice_the_plausible(
    cases: list[Case], all_effects: dict[str, Effect]
) -> None:
    own = {(entry.law, key) for entry in INSIDE for key in entry.ranges}
    for hidden in (h for case in cases for h in case.hidden):
        for key, value in hidden.values.items():
            declared = all_effects[hidden.law].parameters[key]
            if (hidden.law, key) in own:
                continue
            ratio = abs(value / declared.plausible)
            shape = declared.neutral == declared.plausible
            low, high = (0.75, 1.25) if shape else (0.5, 2.0)
            assert low - 1e-9 <= ratio <= high + 1e-9, (hidden.law, key)


def test_every_estimated_parameter_deviates_by_its_prior(
    cases: list[Case], nominal: ParameterSet
) -> None:
    estimated = {p.name for p in nominal if p.kind == "estimated" and p.std is not None}
    deviating = [case for case in cases if case.kind != "none"]
    assert all(set(case.parameters) == estimated for case in deviating)
    steps = [
        (case.parameters[name] - nominal.value(name)) / (nominal[name].std or 1.0)
        for case in deviating
        for name in estimated
    ]
    assert np.std(steps) == pytest.approx(0.98, abs=0.08)


def test_runs_start_anywhere_in_the_gap(cases: list[Case]) -> None:
    gaps = np.array([gap for case in cases for gap in case.gaps])
    assert gaps.min() < -0.9
    assert gaps.max() > 0.9
    assert np.abs(gaps).max() <= 1.0


def test_programs_with_a_truck_do_not_betray_that_the_wheel_is_the_cause(cases: list[Case]) -> None:
    with_truck = [case for case in cases if "program6" in case.programs]
    assert any(case.kind in {"none", "deviation"} for case in with_truck)


def test_effects_of_a_truck_have_one(cases: list[Case]) -> None:
    for case in cases:
        if any(h.effect in {"wheel_slip", "tyre_rolling_loss"} for h in case.hidden):
            assert "program6" in case.programs


def test_every_limit_of_a_ramp_is_below_the_steepest_of_the_programs(nominal: ParameterSet) -> None:
    """A limit above all ramps has no effect, and its law would only be a lag."""
    (entry,) = [one for one in INSIDE if one.effect == "reference_ramp_limit"]
    shortest, _ = entry.ranges["ramp_time"]
    steepest = max(
        float(np.max(np.abs(np.diff(reference) / np.diff(time))))
        for program in map(PROGRAMS.get, ALWAYS)
        if isinstance(program, SpeedProgram)
        for time, reference in [program.reference()]
    )
    assert nominal.values()["speed_limit"] / shortest < steepest
