"""Fits from far off on logs of the independent bench."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fit_result import FitResult, FitValues
from plant_emulator.diagnosis.fitting import approach as approaching
from plant_emulator.diagnosis.fitting.approach import (
    FIRST_ITERATIONS,
    approach,
    fit_null,
    lead,
    lead_best,
    nearest,
)
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machine import Model
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy

Reader = Callable[[str], Log]
RUNS = (0, 1, 2)


@pytest.fixture(scope="module")
def model(bench_log: Reader, nominal: ParameterSet) -> BenchModel:
    """The bench of practice_002, without effects: parameters off by up to 16 %."""
    logs = [bench_log(f"bench_practice/practice_002/program{k}") for k in (1, 2, 3)]
    return BenchModel([recording(log) for log in logs], nominal, {})


def nominal_start(model: BenchModel) -> FitValues:
    """Nominal parameters, and a start in the driving half of the gap."""
    return FitValues(
        effects=(), values=model.nominal(RUNS), states=tuple({GAP_POSITION: 0.5} for _ in RUNS)
    )


def test_fit_along_the_measured_speeds_leads_to_the_noise(model: BenchModel) -> None:
    near = approach(model, nominal_start(model), RUNS)
    found = fit(model, (), RUNS, near.values, near.states)
    assert found.mean_square == pytest.approx(1.0, abs=0.03)
    # tests/data/README.md: what the bench was made with
    assert found.values["drum_inertia"] == pytest.approx(1.006135 * 312.69, rel=0.003)
    assert found.values["backlash_half_gap"] == pytest.approx(
        1.010622 * model.nominal_set.value("backlash_half_gap"), rel=0.003
    )


def test_best_of_the_starts_is_led_on(model: BenchModel) -> None:
    """The gap of the other start is half of the true one, which no few iterations mend."""
    start = nominal_start(model)
    values = {**start.values, "backlash_half_gap": 0.5 * start.values["backlash_half_gap"]}
    wrong = FitValues(effects=(), values=values, states=start.states)
    first = [lead(model, one, RUNS, iterations=FIRST_ITERATIONS) for one in (start, wrong)]
    assert 2.0 * first[0].cost < first[1].cost
    on = lead(model, first[0], RUNS, iterations=5)
    for starts in ([wrong, start], [start, wrong]):
        led = lead_best(model, starts, RUNS, 5)
        assert led.values["drum_inertia"] == pytest.approx(on.values["drum_inertia"], rel=1e-6)


def test_first_start_that_comes_near_the_data_is_led_on(
    model: BenchModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No iteration is spent on a start behind one that a few iterations bring to the noise."""
    start, led = nominal_start(model), []
    right = approach(model, start, RUNS)
    wrong = replace(start, values={**start.values, "drum_inertia": 150.0})

    def listed(there: BenchModel, one: FitValues, *args: object, **more: object) -> FitResult:
        led.append(one.values)
        return lead(there, one, *args, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(approaching, "lead", listed)
    lead_best(model, [wrong, right, start], RUNS, FIRST_ITERATIONS)
    assert led[:2] == [wrong.values, right.values]
    assert start.values not in led


def test_start_near_the_noise_is_kept(model: BenchModel) -> None:
    near = approach(model, nominal_start(model), RUNS)
    reached = fit(model, (), RUNS, near.values, near.states)
    assert nearest(model, [nominal_start(model), reached], RUNS) is reached
    assert nearest(model, [nominal_start(model)], RUNS) is None


class Contacting(Line):
    """A line with a wave that no run along the measured outputs shows."""

    def observer(self, interval: float) -> Line:
        """See `Model`."""
        return Line([noisy(2.0 + 3.0 * TIME)])


@pytest.mark.parametrize(("machine", "again"), [(Line, 0), (Contacting, 1)])
def test_far_fit_is_led_again_only_where_it_was_near_the_data_along_the_measured_outputs(
    machine: type[Line], again: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: a wave of 4 leaves 8 beside the noise of 1."""
    led: list[float] = []

    def approach_again(model: Model, found: FitResult, runs: Sequence[int]) -> FitValues:
        led.append(found.mean_square)
        return approach(model, found, runs)

    monkeypatch.setattr(approaching, "approach", approach_again)
    fit_null(machine([noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME))]), (0,))
    assert led == pytest.approx([9.0] * again, rel=0.1)
