"""What runs can show, before they are driven."""

import json
from collections.abc import Callable
from math import inf

import pytest
from click.testing import CliRunner, Result

from plant_emulator import effects
from plant_emulator.cli import main
from plant_emulator.diagnosis.design.detectability import (
    DetectionLimit,
    EffectDetectability,
    allowed_factor,
    effect_detectability,
    smallest,
)
from plant_emulator.diagnosis.machines.bench_candidates import candidate
from plant_emulator.workflows.detectability import Detectability


def test_smallest_size_lies_where_the_signature_reaches_seven_times_the_noise() -> None:
    assert smallest(((0.03, 3.0), (0.1, 10.0), (0.3, 30.0))) == pytest.approx(0.07)
    assert smallest(((0.03, 14.0), (0.1, 50.0))) == pytest.approx(0.015)


def test_limit_that_does_not_bite_when_small_is_not_seen_when_small() -> None:
    assert smallest(((0.03, 0.0), (0.1, 0.0), (0.3, 0.0), (1.0, 70.0))) == pytest.approx(0.37)


def test_effect_that_never_reaches_it_has_no_smallest_size() -> None:
    assert smallest(((0.03, 0.1), (2.0, 3.0))) == float("inf")


@pytest.mark.parametrize(
    ("name", "factor", "left"),
    [
        ("current_limit", 2.0, 1.42),  # 50 A is plausible, 71 A the bound
        ("current_limit", 1.2, 1.2),
        ("integrator_windup", 2.0, 1.0),
        ("armature_reaction", 2.0, 2.0),
    ],
)
def test_size_beyond_its_bound_was_not_tried(name: str, factor: float, left: float) -> None:
    assert allowed_factor(candidate(effects.load(name)), factor) == pytest.approx(left)


def answer_of(name: str, smallest_: float, raw: float = 5.0) -> EffectDetectability:
    found = DetectionLimit(
        effect=name,
        orthogonal_norm=0.0,
        total_norm=raw,
        smallest_size=smallest_,
        confounded_with="",
        indistinguishable=(name,),
    )
    return effect_detectability(found, candidate(effects.load(name)))


def test_no_size_beyond_the_bounds_is_promised() -> None:
    assert answer_of("current_limit", 1.8).smallest_size == {"reduction": 71.0}


def test_effect_that_might_show_in_a_size_not_tried_is_not_said_to_be_hidden() -> None:
    """10 N m s/rad is plausible and 1000 the bound; twice the plausible size is tried."""
    entry = answer_of("shaft_damping", inf)
    assert entry.smallest_size == {"damping": None}
    assert entry.hidden_up_to == {"damping": 20.0}
    assert answer_of("integrator_windup", inf).hidden_up_to == {}
    assert answer_of("wheel_slip", inf, raw=0.0).hidden_up_to == {}


def test_line_of_the_table_says_what_shows_what_was_tried_and_what_is_missing() -> None:
    found = [
        answer_of("current_limit", 1.8),
        answer_of("shaft_damping", inf),
        answer_of("integrator_windup", inf),
    ]
    _, *rows = Detectability(effects=tuple(found), notes=()).to_text().splitlines()
    sizes = ["reduction 71 A", "damping > 20 N m s/rad", "share: none"]
    assert [row[28:70].rstrip() for row in rows] == sizes
    assert all(row[70:] == entry.needs for row, entry in zip(rows, found, strict=True))


def test_chance_is_told_of_jitter_and_of_nothing_else() -> None:
    untold = [name for name in effects.names() if candidate(effects.load(name)).stochastic]
    assert untold == ["delay_jitter"]


@pytest.fixture(scope="module")
def planned() -> Callable[[str], dict[str, dict[str, object]]]:
    """Return a function: effect -> its entry for programs 1 to 3."""
    result: Result = CliRunner().invoke(
        main, ["detectability", "program1", "program2", "program3", "--json", "-"]
    )
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    assert answer["schema"] == "detectability/1"
    found = {entry["effect"]: entry for entry in answer["effects"]}
    return lambda name: found[name]


@pytest.mark.slow
def test_armature_that_warms_is_hidden_by_the_current_loop(
    planned: Callable[[str], dict[str, object]],
) -> None:
    entry = planned("armature_resistance_heating")
    assert entry["evidence_at_plausible_size"] < 49  # type: ignore[operator]
    assert "armature_voltage_V" in str(entry["needs"])


@pytest.mark.slow
def test_effect_of_the_trucks_wheel_needs_a_truck(
    planned: Callable[[str], dict[str, object]],
) -> None:
    entry = planned("wheel_slip")
    assert entry["evidence_at_plausible_size"] == 0
    assert "truck" in str(entry["needs"])


@pytest.mark.slow
def test_course_of_a_drives_jitter_is_not_promised(
    planned: Callable[[str], dict[str, object]],
) -> None:
    entry = planned("delay_jitter")
    assert entry["smallest_size"] == {"amplitude": None}
    assert entry["evidence_at_plausible_size"] == 0
    assert "cannot be reproduced" in str(entry["needs"])


@pytest.mark.slow
def test_sensor_lag_shows_when_it_is_a_millisecond(
    planned: Callable[[str], dict[str, object]],
) -> None:
    entry = planned("torque_sensor_lag")
    assert entry["needs"] is None
    assert entry["class"] == ["torque_sensor_lag"]
    assert entry["smallest_size"]["time_constant"] < 2e-3  # type: ignore[index]


def test_program_that_does_not_exist_is_refused() -> None:
    result = CliRunner().invoke(main, ["detectability", "program9"])
    assert result.exit_code == 2
    assert "program9" in result.stderr
