"""Drafted laws on logs of the independent bench, whose labels nobody told the search."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from plant_emulator import parameter_sets
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.diagnosis.missing_law.draft import Sketchbook, sketch
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log

PARAMETERS = parameter_sets.load("thesis_table_3_1")

pytestmark = pytest.mark.slow


def drafted(*logs: Log) -> Sketchbook:
    recordings = [recording(log) for log in logs]
    null = fit_null(BenchModel(recordings, PARAMETERS, {}), range(len(recordings)))
    return sketch(recordings, PARAMETERS, null)


def test_lag_of_the_torque_sensor_is_drawn_with_its_time_constant(
    bench_log: Callable[[str], Log],
) -> None:
    found = drafted(*(bench_log(f"bench_practice/practice_003/program{k}") for k in (1, 2, 3)))
    simplest = min((one.law for one in found.sketches), key=lambda law: len(law.terms))
    assert {one.law.quantity.place for one in found.sketches} == {"torque_sensor"}
    assert simplest.terms[0].text == "(lag(T, 0.1 s) - T)"  # the label: 0.1 s
    assert simplest.coefficients[0] == pytest.approx(1.0, abs=0.15)


def test_loss_of_the_gear_is_drawn_over_its_load(bench_log: Callable[[str], Log]) -> None:
    logs = [bench_log(f"bench_practice/practice_009/program{k}") for k in (1, 6)]
    book = drafted(*logs)
    best = book.sketches[0]
    assert book.bound is not None
    assert 0.8 < book.bound.interval[0] <= book.bound.share <= book.bound.interval[1] <= 1.0
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
    book = drafted(*logs)
    assert (book.sketches, book.bound) == ((), None)


def test_slow_logs_are_drafted_without_ripples_of_the_motor(
    bench_log: Callable[[str], Log],
) -> None:
    """At 10 Hz the motor turns by several revolutions from one sample to the next."""
    logs = [bench_log(f"bench_practice/practice_003/program{k}") for k in (1, 2)]
    slow = [
        replace(
            log,
            time=log.time[::10],
            signals={name: own[::10].copy() for name, own in log.signals.items()},
        )
        for log in logs
    ]
    book = drafted(*slow)
    assert book.bound is not None
    best = book.sketches[0].law
    assert best.quantity.place == "torque_sensor"  # the label: its lag of 0.1 s


def test_ripple_of_the_torque_sensor_is_drawn_where_the_motor_turns_fast(
    bench_log: Callable[[str], Log],
) -> None:
    """A cruise turns the motor by 3.8 rad a sample: the means of two samples have another sign."""
    logs = [bench_log(f"bench_practice/practice_004/program{k}") for k in (1, 2)]
    for k, log in enumerate(logs):
        angle = cumulative_trapezoid(log["motor_speed"], log.time, initial=0)
        torque = log["shaft_torque"] + 3.0 * np.cos(1.2 * angle + 0.7)
        logs[k] = replace(log, signals={**log.signals, "shaft_torque": torque})
    law = drafted(*logs).sketches[0].law
    assert (law.quantity.place, len(law.terms)) == ("torque_sensor", 1)
    assert law.terms[0].text == "cos(1.2 theta + phase)"
    assert law.coefficients[0] == pytest.approx(3.0, abs=0.1)
    assert [own["phase11"] for own in law.phases] == pytest.approx([0.7, 0.7], abs=0.1)
