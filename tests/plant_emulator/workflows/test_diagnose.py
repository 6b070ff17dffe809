"""The diagnosis as a library call: the command's answer, its report, and the set to save."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from plant_emulator import effects, logs, parameter_sets
from plant_emulator.cli import main
from plant_emulator.errors import DiagnosisError, InputError
from plant_emulator.signals.log import Log
from plant_emulator.workflows.diagnosis.diagnose import Diagnosis, diagnose
from plant_emulator.workflows.diagnosis.plan import plan_of_runs
from tests.plant_emulator.diagnosis import axis_truth

HIDDEN = "torque_sensor_offset"
LEFT_OUT = [name for name in effects.names() if name != HIDDEN]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A log of the nominal bench whose torque sensor is off by its plausible size."""
    file = tmp_path_factory.mktemp("logs") / "run.csv"
    words = ["simulate", "--program", "program1", "--effect", HIDDEN, "--seed", "1"]
    result = CliRunner().invoke(main, [*words, "--out", str(file)])
    assert result.exit_code == 0, result.output
    return str(file)


@pytest.fixture(scope="module")
def log(path: str) -> Log:
    return logs.read(path)


@pytest.fixture(scope="module")
def diagnosis(log: Log) -> Diagnosis:
    return diagnose([log], without=LEFT_OUT, settings={"script": "first.py"})


@pytest.mark.slow
def test_hidden_effect_is_named_with_its_size(diagnosis: Diagnosis) -> None:
    (entry,) = diagnosis.answer.ranking
    (size,) = entry.parameters
    assert diagnosis.answer.verdict.effects == (HIDDEN,)
    assert abs(size.value - effects.load(HIDDEN).plausible()["offset"]) < 4.0 * size.standard_error


@pytest.mark.slow
def test_command_gives_the_answer_of_the_library(path: str, diagnosis: Diagnosis) -> None:
    left_out = [word for name in LEFT_OUT for word in ("--without", name)]
    told = CliRunner().invoke(main, ["diagnose", path, *left_out, "--workers", "1", "--json", "-"])
    assert told.exit_code == 0, told.output
    assert json.loads(told.stdout) == diagnosis.to_json()


def test_print_shows_the_screen_of_the_command(diagnosis: Diagnosis) -> None:
    rows = str(diagnosis).splitlines()
    assert rows[0].startswith("EFFECT FOUND")
    assert max(map(len, rows)) <= 80
    assert len(rows) < 24


@pytest.mark.slow
def test_repr_says_verdict_effect_and_share(diagnosis: Diagnosis) -> None:
    assert repr(diagnosis).startswith(f"<Diagnosis: Effect found, {HIDDEN}; ")
    assert repr(diagnosis).endswith(" % of the held-out gap closed>")


def test_report_tells_how_to_repeat_it(diagnosis: Diagnosis, tmp_path: Path) -> None:
    diagnosis.write_report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page == diagnosis.to_html()
    assert "first.py" in page


def test_parameter_set_holds_the_effect_and_can_be_loaded(
    diagnosis: Diagnosis, tmp_path: Path
) -> None:
    parameter_sets.save(diagnosis.parameter_set, tmp_path / "set.toml")
    saved = parameter_sets.load(str(tmp_path / "set.toml"))
    (size,) = diagnosis.answer.ranking[0].parameters
    assert saved.effects[HIDDEN]["offset"] == pytest.approx(size.value, rel=1e-6)


def test_log_of_another_machine_is_refused(log: Log) -> None:
    with pytest.raises(DiagnosisError, match="needs the model bench"):
        diagnose([log], model="axis")
    with pytest.raises(DiagnosisError, match="needs the model axis"):
        diagnose([axis_truth.log()])


def test_no_log_is_refused() -> None:
    with pytest.raises(InputError, match="at least one is needed"):
        diagnose([])


def test_each_of_several_logs_is_predicted_from_the_others() -> None:
    assert plan_of_runs(3, 3).folds == (((1, 2), (0,)), ((0, 2), (1,)), ((0, 1), (2,)))
    assert plan_of_runs(3, 2).folds == (((0, 1), (2,)),)
