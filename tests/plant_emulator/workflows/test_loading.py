"""Which logs are taken: without their own answer, each run once, and of one bench."""

import gzip
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from plant_emulator import logs
from plant_emulator.cli import main
from plant_emulator.errors import DiagnosisError, LogError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.sensors import Sensor
from plant_emulator.recordings.preflight import preflight
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.signals.noise import noise
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise
from plant_emulator.workflows.diagnosis.plan import plan_recordings
from plant_emulator.workflows.loading import check_unlabelled, load_recordings
from plant_emulator.workflows.simulation import simulate
from register_maps.signals import LOG_COLUMNS

DATA = Path(__file__).parents[2] / "data"
PROGRAM1 = DATA / "bench_nominal" / "program1.csv.gz"
BenchLog = Callable[[str], Log]


def refused(*arguments: str | Path) -> str:
    """The one line of a refusal."""
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    return line


@pytest.mark.parametrize(
    "column",
    ["label", "labels", "effects", "true_effect", "is_faulty", "class", "answer", "anomaly",
     "scenario", "cause-of-gap", "drift_fg", "groundTruth", "isFaulty", "FAULT"],
)  # fmt: skip
def test_column_that_tells_the_answer_is_refused(column: str) -> None:
    log = Log(np.zeros(1), {}, "run.csv", other=(column,))
    with pytest.raises(LogError, match=f"run.csv: line 1: column {column} looks like"):
        check_unlabelled(log)


@pytest.mark.parametrize(
    "column", [*LOG_COLUMNS, "effective_voltage_V", "brake_defined", "clock_s"]
)
def test_measured_column_is_no_answer(column: str) -> None:
    check_unlabelled(Log(np.zeros(1), {}, "run.csv", other=(column,)))


@pytest.mark.parametrize("command", ["diagnose", "detectability", "identify"])
@pytest.mark.parametrize("packing", ["plain", "packed again", "later clock"])
def test_same_run_in_another_packing_is_refused(tmp_path: Path, command: str, packing: str) -> None:
    text = gzip.decompress(PROGRAM1.read_bytes())
    copy = tmp_path / ("p1.csv" if packing == "plain" else "p1.csv.gz")
    if packing == "later clock":
        log = logs.read(PROGRAM1)
        logs.write(replace(log, time=log.time + 7.0), copy)
    else:
        copy.write_bytes(text if packing == "plain" else gzip.compress(text, 1))
    assert f"{copy}: the same run as {PROGRAM1}; give every run once" in refused(
        command, PROGRAM1, copy
    )


@pytest.mark.parametrize("command", ["diagnose", "detectability", "identify"])
def test_log_that_tells_its_answer_is_refused(tmp_path: Path, command: str) -> None:
    head, *rows = gzip.decompress(PROGRAM1.read_bytes()).decode().splitlines()
    told = tmp_path / "told.csv"
    told.write_text("\n".join([f"{head},label", *(f"{row},1" for row in rows), ""]))
    assert f"{told}: line 1: column label looks like the answer" in refused(command, told)


@pytest.mark.parametrize("command", ["diagnose", "detectability", "identify"])
def test_logs_of_two_benches_are_refused(command: str) -> None:
    practice = DATA / "bench_practice"
    first, second = (
        practice / f"{name}.csv.gz" for name in ("practice_002/program1", "practice_001/program2")
    )
    assert "give logs of one bench" in refused(command, first, second)


@pytest.mark.parametrize(
    ("still", "told"), [("before", "in the first 60 % of it"), ("after", "in the last 40 % of it")]
)
def test_single_log_of_which_a_part_stands_still_is_refused(
    bench_log: BenchLog, still: str, told: str
) -> None:
    log = bench_log("bench_practice/practice_004/program2")
    count = 2 * len(log.time)
    width = (count, 0) if still == "before" else (0, count)
    signals = {name: np.pad(values, width) for name, values in log.signals.items()}
    noise = np.random.default_rng(1).normal(0.0, 0.1, 3 * len(log.time))
    signals["motor_speed"] = signals["motor_speed"] + noise
    time = np.arange(3 * len(log.time), dtype=np.float64) * 0.01
    whole = Log(time, signals, "run.csv")
    use = preflight(whole, 62.6).use
    with pytest.raises(DiagnosisError, match=f"run.csv: no held-out run is possible: {told}"):
        plan_recordings([recording(whole, use=use)], 1)


def test_single_log_that_moves_in_both_parts_is_taken(bench_log: BenchLog) -> None:
    runs, plan = plan_recordings([recording(bench_log("bench_practice/practice_004/program2"))], 1)
    assert len(runs) == 2
    assert plan.as_fitted


def test_logs_that_are_read_together_share_the_noise_of_their_sensors(
    bench_log: BenchLog, nominal: ParameterSet
) -> None:
    quiet, loud = (add_noise(bench_log(f"bench_nominal/program{k}"), k) for k in (2, 3))
    restless = np.random.default_rng(4).choice((-1.0, 1.0), len(loud.time))
    moved = {**loud.signals, "armature_current": loud["armature_current"] + restless}
    loud = replace(loud, signals=moved)
    for one in load_recordings([quiet, loud], nominal)[0]:
        found = one.noise[one.channels.index("armature_current")]
        assert found == pytest.approx(SENSORS["armature_current"][0], rel=0.05)
    sensors = {"armature_current": Sensor(noise=0.7)}
    for one in load_recordings([quiet, loud], replace(nominal, sensors=sensors))[0]:
        assert one.noise[one.channels.index("armature_current")] == pytest.approx(0.7, rel=1e-9)


def test_noise_of_a_recording_is_that_beside_a_simulation(nominal: ParameterSet) -> None:
    """The reference goes to and fro by 1 rad/s between samples; the current follows, by amperes."""
    time = np.arange(0.0, 8.0, 0.01)
    ramp = np.clip(60.0 * (time - 1.0), 0.0, 200.0)
    zigzag = np.where(ramp > 0.0, np.random.default_rng(3).uniform(-0.5, 0.5, len(time)), 0.0)
    asked = {
        "speed_reference": ramp + zigzag,
        "reference_knee_time": np.full(len(time), 0.004),
        "reference_knee": ramp + zigzag,
    }
    true = simulate(Log(time, asked), parameters=nominal, start="middle")
    measured = add_noise(Log(time, {**true.signals, **asked}), seed=5)
    (loaded,), _ = load_recordings([measured], nominal)
    assert noise(measured["armature_current"]) > 2.0 * SENSORS["armature_current"][0]
    found = loaded.noise[loaded.channels.index("armature_current")]
    assert found == pytest.approx(SENSORS["armature_current"][0], rel=0.1)
