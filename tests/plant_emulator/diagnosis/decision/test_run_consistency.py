"""Runs each fitted alone: what was done to two benches (tests/data/README.md) is told."""

import re
from collections.abc import Callable

import pytest

from plant_emulator.diagnosis.decision import run_consistency
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.solver.kernel import kernel
from tests.plant_emulator.diagnosis.line import TIME, Line

BenchLog = Callable[[str], Log]
NUMBER = r"(\d\S+) \+- (\d\S+) s in "


def told(nominal: ParameterSet, *logs: Log) -> str:
    model = BenchModel([recording(log) for log in logs], nominal, kernel().effects)
    runs = range(len(logs))
    found = [fit_null(model, (run,)) for run in runs]
    return run_consistency.inconsistency(model, runs, found)


def fitted(a: float, squares: float) -> FitResult:
    """A line at this level, known to 0.1 in white noise."""
    return FitResult(
        effects=(),
        values={"a": a, "b": 0.0},
        states=({},),
        cost=squares,
        sum_of_squares=squares,
        samples=100,
        effective_fraction=1.0,
        standard_errors={"a": 0.1, "b": 0.1},
        converged=True,
    )


@pytest.mark.parametrize(
    ("level", "squares", "differs"),
    [(9.0, 100.0, True), (9.0, 400.0, False), (2.6, 100.0, False)],
)
def test_runs_differ_where_each_alone_leaves_noise(
    level: float, squares: float, differs: bool
) -> None:
    """By hand: errors of 0.1 each are 0.14, of which 5 are 0.7; 400 is four times the noise."""
    model = Line([TIME, TIME], ())
    found = [fitted(2.0, squares), fitted(level, squares)]
    told = run_consistency.inconsistency(model, (0, 1), found)
    assert bool(told) == differs
    assert ("a is 2.0" in told) == differs


def test_two_drifted_benches_differ_in_what_was_shifted_most(
    bench_log: BenchLog, nominal: ParameterSet
) -> None:
    logs = (
        bench_log(f"bench_practice/{name}")
        for name in ("practice_002/program1", "practice_008/program3")
    )
    found = told(nominal, *logs)
    # The dead time, by +2.0889 and -7.0835 %, which a step of the reference tells best.
    values = re.search(
        rf"dead_time is {NUMBER}practice_002/program1\S* and {NUMBER}practice_008/program3", found
    )
    assert values is not None
    first, error, second, other = map(float, values.groups())
    assert first == pytest.approx(1.020889 * nominal.value("dead_time"), abs=4.0 * error)
    assert second == pytest.approx(0.929165 * nominal.value("dead_time"), abs=4.0 * other)


@pytest.mark.slow
@pytest.mark.parametrize("bench", ["practice_002", "practice_008"])
def test_runs_of_one_drifted_bench_do_not_differ(
    bench: str, bench_log: BenchLog, nominal: ParameterSet
) -> None:
    logs = (bench_log(f"bench_practice/{bench}/program{k}") for k in (1, 2, 3))
    assert told(nominal, *logs) == ""


def test_run_that_has_an_effect_is_not_taken_for_another_bench(
    bench_log: BenchLog, nominal: ParameterSet
) -> None:
    logs = (
        bench_log(f"bench_practice/{name}")
        for name in ("practice_002/program1", "practice_003/program1")
    )
    assert told(nominal, *logs) == ""
