"""A saved set is the model that was fitted: what is a run's own is found again for every run."""

from collections.abc import Callable
from dataclasses import replace
from math import pi
from typing import Any, cast

import numpy as np
import pytest

from plant_emulator import effects
from plant_emulator.diagnosis.diagnose import Findings
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.diagnosis.report.document import from_json
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.workflows.diagnosis.saved_set import parameter_set
from plant_emulator.workflows.simulation import simulate
from tests.plant_emulator.diagnosis import answers

BenchLog = Callable[[str], Log]


def diagnosis(name: str, **states: tuple[float, ...]) -> Findings:
    """A diagnosis that names an effect, with these values of its states by run."""
    plausible = effects.load(name).plausible()
    runs = zip(*states.values(), strict=True)
    final = FitResult(
        effects=(name,), values={},
        states=tuple({f"{name}_{k}": v for k, v in zip(states, run, strict=True)} for run in runs),
        cost=0.0, sum_of_squares=0.0, samples=1, effective_fraction=1.0,
        standard_errors={}, converged=True,
    )  # fmt: skip
    answer = from_json(answers.effect())
    return Findings(
        answer=replace(answer, verdict=replace(answer.verdict, effects=(name,))),
        details=cast("Any", None),
        final=final,
        fixed={name: {k: v for k, v in plausible.items() if k not in states}},
    )


@pytest.mark.parametrize(
    ("phases", "mean"), [((3.0, -3.0), pi), ((0.1, 2 * pi - 0.1), 0.0), ((1.0, 2.0), 1.5)]
)
def test_mean_of_angles_is_on_the_circle(
    nominal: ParameterSet, phases: tuple[float, ...], mean: float
) -> None:
    saved = parameter_set(diagnosis("gear_eccentricity", phase=phases), nominal, [], {})
    apart = saved.effects["gear_eccentricity"]["phase"] - mean
    assert np.cos(apart) == pytest.approx(1.0)


def test_shell_is_saved_as_warm_as_it_was_measured(
    nominal: ParameterSet, bench_log: BenchLog
) -> None:
    log = bench_log("bench_practice/practice_004/program2")
    found = diagnosis("gear_oil_temperature", start_temperature=(300.0, 310.0))
    own = parameter_set(found, nominal, [recording(log)], {}).effects["gear_oil_temperature"]
    assert own["start_temperature"] == 305.0
    # 32.06 degC in the log's first row, and it warms by less than 2 K
    assert own["shell_temperature"] == pytest.approx(273.15 + 33.0, abs=1.5)


def test_run_is_followed_from_its_own_start_of_the_sets_effects(nominal: ParameterSet) -> None:
    """Made with a phase of 2 rad; the set has the mean of other runs, 0."""
    made = {"gear_eccentricity": {"amplitude": 0.3, "phase": 2.0}}
    log = simulate("program1", parameters=nominal, effects=made, seed=1)
    known = ParameterSet(
        nominal.name,
        nominal.parameters,
        effects={"gear_eccentricity": {"amplitude": 0.3, "phase": 0.0}},
    )
    own = simulate(log, parameters=known)
    assert rms(log, own) < 1.1 * SENSORS["shaft_torque"][0]
    # as it was asked for, a value stays
    asked = simulate(log, parameters=nominal, effects=known.effects)
    assert rms(log, asked) > 2.0 * SENSORS["shaft_torque"][0]


@pytest.mark.slow
def test_diagnosis_finds_each_runs_own_start_of_the_sets_effects(nominal: ParameterSet) -> None:
    """Two runs of a bench whose gear is eccentric, from other angles than the set's."""
    wobble = {**effects.load("gear_eccentricity").plausible(), "phase": 0.0}
    bench = replace(nominal, effects={"gear_eccentricity": wobble})
    runs = []
    for seed, phase in enumerate((1.0, 4.0)):
        own = replace(nominal, effects={"gear_eccentricity": {**wobble, "phase": phase}})
        runs.append(recording(simulate("program1", parameters=own, seed=seed)))
    model = BenchRecipe(tuple(runs), bench).build()
    assert "gear_eccentricity" not in model.candidates
    found = fit_null(model, (0, 1))
    assert found.mean_square < 1.1
    for state, phase in zip(found.states, (1.0, 4.0), strict=True):
        assert np.cos(state["gear_eccentricity_phase"] - phase) > 0.95
    assert model.locate(found, (0, 1)) is None


def rms(log: Log, simulation: Log) -> float:
    difference = log["shaft_torque"] - simulation["shaft_torque"]
    return float(np.sqrt(np.mean(difference**2)))
