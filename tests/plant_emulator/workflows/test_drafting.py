"""A missing law from the logs to a saved set: drafted, tried on held-out runs, saved, simulated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from plant_emulator import effects, parameter_sets
from plant_emulator.diagnosis.diagnose import Findings
from plant_emulator.diagnosis.execution.pool import InProcess
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.diagnosis.report.document import from_json
from plant_emulator.emulator.emulator import Options, build
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.parameter_sets import with_effects
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.workflows.diagnosis.diagnose import Diagnosis, diagnose
from plant_emulator.workflows.diagnosis.drafting import draft
from plant_emulator.workflows.diagnosis.runs import bench_runs
from plant_emulator.workflows.simulation import simulate
from plant_emulator.workflows.validation import validate
from tests.plant_emulator.diagnosis import answers

FOLDER = Path(__file__).parents[2] / "data" / "bench_practice"


@pytest.mark.slow
def test_lag_of_the_torque_sensor_is_drafted_saved_and_simulated(
    nominal: ParameterSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(effects, "_of_sets", {})
    logs = [FOLDER / "practice_003" / f"program{k}.csv.gz" for k in (1, 2, 3)]
    runs = bench_runs(logs[:2], (), nominal)
    null = fit_null(BenchModel(runs.fitted, nominal, {}), range(2))
    found = draft(runs, null, InProcess(), tmp_path / "drafts")
    assert found is not None
    best = found.drafts[0]
    assert best.place == "torque_sensor"
    assert "shaft torque" in best.over
    assert best.held_out_gain is not None
    assert (
        best.held_out_gain > 0.8
    )  # one run of two predicts the other: of a true effect's 1 at most
    assert best.bound is not None
    assert best.bound_ci95 is not None
    assert best.held_out_gain <= best.bound <= best.bound_ci95[1] <= 1.0

    answer = replace(from_json(answers.unknown()), drafts=found.drafts)
    findings = Findings(answer=answer, details=None, final=null, fixed={})  # type: ignore[arg-type]
    whole = Diagnosis(findings=findings, given=nominal, fitted=runs.fitted, drafted=found)
    parameter_sets.save(whole.parameter_set, tmp_path / "bench.toml")
    assert 'file = "drafts/' in (tmp_path / "bench.toml").read_text()

    # the third run, which nothing was fitted to: the sensor's noise is 0.25 N m
    saved = tmp_path / "bench.toml"
    errors = []
    for one in (nominal.with_values(null.values), with_effects.load(saved)):
        (own,) = validate([logs[2]], parameters=one).to_json()["logs"].values()
        errors.append(own["shaft_torque"]["nrmsd"])
    assert errors[1] < 0.5 * errors[0]

    # the saved set beside a bench with the effect of the label: rms of the noise 0.25 N m
    known = with_effects.load(saved)
    plain = replace(known, effects={}, effect_files={})
    labelled = simulate(
        "program1", parameters=plain, effects=["torque_sensor_lag:time_constant=0.1"]
    )
    drafted = simulate("program1", parameters=saved)
    assert np.std(drafted["shaft_torque"] - labelled["shaft_torque"]) < 0.25

    # the emulator that serves the set, when the speed steps
    steps = [50.0] * 300
    served = build(Options(parameters=str(saved), port=0)).plc.bench.advance(steps).shaft_torque
    lagging = Bench(plain, {"torque_sensor_lag": {"time_constant": 0.1}}).advance(steps)
    np.testing.assert_allclose(served, lagging.shaft_torque, atol=0.05 * np.ptp(served))

    # the same logs again: nothing is named, and only noise is left in the torque
    others = [name for name in effects.names() if not name.startswith("torque_sensor")]
    again = diagnose(logs[:2], parameters=saved, without=others).answer
    assert again.verdict.kind in {"none", "parameter"}
    assert again.gap.nominal["shaft_torque"] < 1.1 * again.gap.noise_floor["shaft_torque"]
