"""What runs can show, before they are driven."""

import json
from collections.abc import Callable

import pytest
from click.testing import CliRunner, Result

from plant_emulator.cli import main
from plant_emulator.diagnosis.detect import smallest


def test_smallest_size_lies_where_the_signature_reaches_seven_times_the_noise() -> None:
    assert smallest(((0.03, 3.0), (0.1, 10.0), (0.3, 30.0))) == pytest.approx(0.07)
    assert smallest(((0.03, 14.0), (0.1, 50.0))) == pytest.approx(0.015)


def test_limit_that_does_not_bite_when_small_is_not_seen_when_small() -> None:
    assert smallest(((0.03, 0.0), (0.1, 0.0), (0.3, 0.0), (1.0, 70.0))) == pytest.approx(0.37)


def test_effect_that_never_reaches_it_has_no_smallest_size() -> None:
    assert smallest(((0.03, 0.1), (2.0, 3.0))) == float("inf")


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
