"""Logs of two benches are refused; what a run, oil or an effect changes is not taken for it."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from plant_emulator import effects
from plant_emulator.cli import main
from plant_emulator.errors import LogError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.same_bench import (
    BENCH_DIFFERENCE,
    EQUATION_ERROR,
    check_same_bench,
    speed_deficit_of,
)
from plant_emulator.signals.log import Log
from plant_emulator.workflows.simulation import simulate

DATA = Path(__file__).parents[2] / "data" / "bench_practice"
BENCHES = {
    "practice_002": (1, 2, 3),
    "practice_003": (1, 2, 3),
    "practice_004": (1, 2, 3),
    "practice_008": (1, 2, 3),
    "practice_009": (1, 6),
}
OTHER = "practice_001/program2"
"""Its drum's sensor shows 1.2 % less (tests/data/README.md)."""

BenchLog = Callable[[str], Log]


@pytest.fixture(scope="module")
def values(nominal: ParameterSet) -> Mapping[str, float]:
    return nominal.values()


def logs_of(bench: str, bench_log: BenchLog) -> list[Log]:
    return [bench_log(f"bench_practice/{bench}/program{k}") for k in BENCHES[bench]]


@pytest.mark.parametrize("bench", BENCHES)
def test_runs_of_check_same_bench_are_taken(
    bench: str, bench_log: BenchLog, values: Mapping[str, float]
) -> None:
    check_same_bench(logs_of(bench, bench_log), values)


@pytest.mark.parametrize("bench", BENCHES)
def test_run_of_a_bench_whose_drum_shows_less_is_refused_beside_every_other(
    bench: str, bench_log: BenchLog, values: Mapping[str, float]
) -> None:
    other = bench_log(f"bench_practice/{OTHER}")
    for log in logs_of(bench, bench_log):
        if "wheel_torque" in log:
            continue
        with pytest.raises(LogError, match=r"program2.*: drum speed over motor speed is 98\.8\d %"):
            check_same_bench([log, other], values)


def test_scale_that_was_hidden_is_found(bench_log: BenchLog, values: Mapping[str, float]) -> None:
    found = speed_deficit_of(bench_log(f"bench_practice/{OTHER}"), values)
    assert found is not None
    assert found.error < 2e-4
    assert found.share == pytest.approx(0.012, abs=4.0 * found.error)


def test_scale_of_the_nominal_bench_is_nothing(
    bench_log: BenchLog, values: Mapping[str, float]
) -> None:
    for program in ("program1", "program2", "program3", "program4"):
        found = speed_deficit_of(bench_log(f"bench_nominal/{program}"), values)
        assert found is not None
        assert abs(found.share) < EQUATION_ERROR


@pytest.mark.parametrize("lag", [0.07, 0.1])
def test_lag_of_the_drums_sensor_hides_no_contact(
    lag: float, nominal: ParameterSet, values: Mapping[str, float]
) -> None:
    effect = {"drum_speed_lag": {"time_constant": lag}}
    log = simulate("program1", parameters=nominal, effects=effect, seed=1)
    found = speed_deficit_of(log, values)
    assert found is not None
    assert abs(found.share) < EQUATION_ERROR


def test_difference_of_a_sensors_scale_is_told_from_six_errors_on(
    bench_log: BenchLog, values: Mapping[str, float]
) -> None:
    log = bench_log("bench_practice/practice_002/program2")
    limit = BENCH_DIFFERENCE * EQUATION_ERROR
    for scale, refused in ((0.9 * limit, False), (1.2 * limit, True)):
        signals = {**log.signals, "drum_speed": (1.0 + scale) * log["drum_speed"]}
        pair = [log, replace(log, signals=signals)]
        if refused:
            with pytest.raises(LogError, match=r"100\.\d\d %"):
                check_same_bench(pair, values)
        else:
            check_same_bench(pair, values)


@pytest.mark.parametrize(
    "name",
    [
        "drum_speed_lag",
        "drum_speed_slip",
        "drum_speed_scale",
        "drum_bearing_friction",
        "drum_imbalance",
        "gear_oil_temperature",
        "motor_speed_scale",
    ],
)
def test_twice_an_effect_in_every_run_is_no_second_bench(
    name: str, nominal: ParameterSet, values: Mapping[str, float]
) -> None:
    sizes = {
        key: p.plausible if p.neutral is None else 2.0 * p.plausible - p.neutral
        for key, p in effects.load(name).parameters.items()
    }
    logs = [
        simulate(program, parameters=nominal, effects={name: sizes}, seed=seed)
        for seed, program in enumerate(("program1", "program2", "program3", "program4"))
    ]
    check_same_bench(logs, values)


def test_run_with_a_truck_tells_nothing(bench_log: BenchLog, values: Mapping[str, float]) -> None:
    assert speed_deficit_of(bench_log("bench_practice/practice_009/program6"), values) is None


def test_diagnosis_of_two_benches_is_refused_in_one_line() -> None:
    first, second = (
        DATA / f"{name}.csv.gz" for name in ("practice_002/program1", "practice_001/program2")
    )
    result = CliRunner().invoke(main, ["diagnose", str(first), str(second)])
    assert result.exit_code == 2
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    for told in (str(first), str(second), "98.8", "give logs of one bench"):
        assert told in line
