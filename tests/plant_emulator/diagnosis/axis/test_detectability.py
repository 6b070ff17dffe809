"""What runs of an axis can show, against diagnoses of axes with effects of such sizes."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from plant_emulator.cli import main
from plant_emulator.diagnosis.axis.detectability import detection_limits
from plant_emulator.diagnosis.axis.diagnose import AxisRuns, diagnose_axis
from plant_emulator.diagnosis.axis.effects import NAMES
from plant_emulator.workflows.diagnosis.plan import plan_of_runs
from tests.plant_emulator.diagnosis import axis_truth as truth


@pytest.mark.slow
def test_an_effect_is_named_from_about_the_smallest_size_on() -> None:
    found = {one.effect: one for one in detection_limits([truth.log()])}
    smallest = found["quadratic_drag"].smallest_size["coefficient"]
    assert smallest is not None
    for times, effects in ((2.0, ("quadratic_drag",)), (0.3, ())):
        size = times * smallest
        logs = tuple(
            truth.log(lambda q, v, a, size=size: size * v * np.abs(v), phase=p, seed=k)
            for k, p in ((1, 0.0), (2, 1.0))
        )
        answer = diagnose_axis(AxisRuns(logs), plan_of_runs(2, 1), settings={}).answer
        assert answer.verdict.effects == effects


@pytest.mark.slow
def test_the_command_tells_each_effect_and_what_a_run_lacks(tmp_path: Path) -> None:
    log, path = truth.log(), tmp_path / "run.csv"
    columns = np.stack([1e3 * log.time, 1e3 * log.position, log.force], axis=1)
    np.savetxt(path, columns, fmt="%.7f", delimiter=",", header="t,x,F", comments="")
    chosen = ["time=t:ms", "position=x:mm", "force=F:N"]
    words = ["detectability", "--model", "axis", str(path), "--json", str(tmp_path / "d.json")]
    result = CliRunner().invoke(main, [*words, *(w for c in chosen for w in ("--column", c))])
    assert result.exit_code == 0, result.output
    told = json.loads((tmp_path / "d.json").read_text())
    assert told["schema"] == "detectability/1"
    assert {one["effect"] for one in told["effects"]} == set(NAMES)
    by_name = {one["effect"]: one for one in told["effects"]}
    assert by_name["gravity"]["needs"] == "an axis that swings"
    assert by_name["gravity"]["smallest_size"] == {"sine": None, "cosine": None}
    assert by_name["stribeck"]["units"] == {"rise": "N"}
    assert "delay" in result.stdout


def test_an_option_of_the_other_model_is_refused() -> None:
    result = CliRunner().invoke(main, ["detectability", "program1", "--column", "time=t:ms"])
    assert result.exit_code == 2
    assert "--column belongs to --model axis" in result.output
