"""Drafted laws on logs of the independent bench, whose labels nobody told the search."""

from collections.abc import Callable

import pytest

from plant_emulator import parameter_sets
from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.diagnosis.missing_law.draft import Sketch, sketches
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log

PARAMETERS = parameter_sets.load("thesis_table_3_1")

pytestmark = pytest.mark.slow


def drafted(*logs: Log) -> list[Sketch]:
    recordings = [recording(log) for log in logs]
    null = fit_null(BenchModel(recordings, PARAMETERS, {}), range(len(recordings)))
    return sketches(recordings, PARAMETERS, null)


def test_lag_of_the_torque_sensor_is_drawn_with_its_time_constant(
    bench_log: Callable[[str], Log],
) -> None:
    found = drafted(*(bench_log(f"bench_practice/practice_003/program{k}") for k in (1, 2, 3)))
    simplest = min((sketch.law for sketch in found), key=lambda law: len(law.terms))
    assert {sketch.law.quantity.place for sketch in found} == {"torque_sensor"}
    assert simplest.terms[0].text == "(lag(T, 0.1 s) - T)"  # the label: 0.1 s
    assert simplest.coefficients[0] == pytest.approx(1.0, abs=0.15)


def test_loss_of_the_gear_is_drawn_over_its_load(bench_log: Callable[[str], Log]) -> None:
    logs = [bench_log(f"bench_practice/practice_009/program{k}") for k in (1, 6)]
    best, *_ = drafted(*logs)
    assert best.law.quantity.place == "gear"
    assert best.law.terms[0].text == "|T|"
    assert best.law.coefficients[0] == pytest.approx(0.14, abs=0.03)  # the label: 0.14
    ends = (best.curve.values[0], best.curve.values[-1])
    middle = best.curve.values[len(best.curve.values) // 2]
    assert best.curve.over == "torque to the drum along the motion"
    assert min(ends) > middle + 5.0 * max(best.curve.band)


@pytest.mark.parametrize("case", ["practice_002", "practice_004", "practice_008"])
def test_a_bench_without_an_effect_gets_no_draft(
    bench_log: Callable[[str], Log], case: str
) -> None:
    logs = [bench_log(f"bench_practice/{case}/program{k}") for k in (1, 2, 3)]
    assert drafted(*logs) == []
