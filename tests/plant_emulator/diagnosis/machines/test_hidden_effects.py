"""Which effects a run of the bench can show, and what follows for folds and parameters."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator import effects
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.diagnosis.machines.bench_candidates import LOG_WHEEL_TORQUE
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import Recording
from plant_emulator.recordings.wheel_torque import TAKEN
from plant_emulator.signals.log import TRUCK, WHEEL_TORQUE, Log
from plant_emulator.workflows.diagnosis.plan import plan_recordings
from plant_emulator.workflows.diagnosis.runs import bench_runs
from plant_emulator.workflows.loading import load_recordings
from plant_emulator.workflows.simulation import simulate

LIBRARY = {
    name: effects.load(name)
    for name in ("gear_eccentricity", "tyre_rolling_loss", "motor_friction", "torque_sensor_offset")
}


@pytest.fixture(scope="module")
def runs(nominal: ParameterSet) -> dict[str, Recording]:
    """Runs without a truck, with a truck, and with a truck whose torque nobody measured."""
    travel = simulate("program6")
    signals = {k: v for k, v in travel.signals.items() if k != WHEEL_TORQUE}
    unknown = replace(travel, signals={**signals, TRUCK: np.ones(len(travel.time))})

    def loaded(log: Log) -> Recording:
        return load_recordings([log], nominal)[0][0]

    logs = {"free": simulate("program1"), "truck": travel, "unknown": unknown}
    return {name: loaded(log) for name, log in logs.items()}


def test_run_hides_what_its_unknown_torque_explains_and_what_only_a_truck_shows(
    nominal: ParameterSet, runs: dict[str, Recording]
) -> None:
    model = BenchModel([runs["free"], runs["truck"], runs["unknown"]], nominal, LIBRARY)
    assert [set(run.hides) for run in model.runs] == [
        {"tyre_rolling_loss"},
        set(),
        {"gear_eccentricity", "tyre_rolling_loss"},
    ]


@pytest.mark.parametrize(
    ("given", "asks"),
    [
        (("free",), set()),
        (("unknown",), {"gear_eccentricity", "tyre_rolling_loss"}),
        (("free", "unknown"), {"tyre_rolling_loss"}),
        (("truck", "unknown"), set()),
    ],
)
def test_wheel_torque_is_asked_for_where_its_lack_hides_an_effect(
    nominal: ParameterSet, runs: dict[str, Recording], given: tuple[str, ...], asks: set[str]
) -> None:
    model = BenchModel([runs[name] for name in given], nominal, LIBRARY)
    changed = {n for n, one in model.candidates.items() if one.needs != LIBRARY[n].needs}
    assert changed == asks
    assert all(model.candidates[n].needs.startswith(LOG_WHEEL_TORQUE) for n in asks)
    free = {n for n in asks if "without a truck" in model.candidates[n].needs}
    assert free == asks - {"tyre_rolling_loss"}


def test_parameters_that_the_estimate_of_a_torque_takes_stay_as_they_are(
    nominal: ParameterSet, runs: dict[str, Recording]
) -> None:
    def free(*given: str) -> set[str]:
        model = BenchModel([runs[name] for name in given], nominal, LIBRARY)
        return {u.name for u in model.parameters}

    assert free("truck") - free("unknown") == set(TAKEN)
    assert free("free", "unknown") >= set(TAKEN)


def test_a_run_that_is_held_out_frees_no_parameter(
    nominal: ParameterSet, runs: dict[str, Recording]
) -> None:
    fitted, held_out = [runs["unknown"].log], [runs["free"].log]
    model = bench_runs(fitted, held_out, nominal).recipe.build()
    assert not {u.name for u in model.parameters} & set(TAKEN)


def test_a_truck_of_unknown_torque_predicts_no_other_run(
    runs: dict[str, Recording],
) -> None:
    pair = [runs["free"], runs["unknown"]]
    assert plan_recordings(pair, 2)[1].folds == (((0,), (1,)),)
    assert plan_recordings(2 * [runs["unknown"]], 2)[1].folds == (((1,), (0,)), ((0,), (1,)))


def test_turns_of_a_run_are_those_that_the_drum_makes(
    runs: dict[str, Recording], nominal: ParameterSet
) -> None:
    """By hand: the integral of the drum's speed in the log; the gear may lead by its backlash."""
    model = BenchModel([runs["free"]], nominal, {})
    log = runs["free"].log
    course = model.course(0, (), {GAP_POSITION: 0.0})
    assert course is not None
    turns = course.turns
    assert turns is not None
    assert turns.shape == log.time.shape
    assert course.channels.shape == model.runs[0].measured.shape
    made = np.mean(log["drum_speed"]) * np.ptp(log.time) / (2.0 * np.pi)
    assert made > 10.0
    assert turns[-1] - turns[0] == pytest.approx(made, abs=0.1)
    assert model.course(0, (), {GAP_POSITION: 0.0, "drum_inertia": np.nan}) is None
