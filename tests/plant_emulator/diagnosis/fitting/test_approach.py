"""Fits from far off on logs of the independent bench."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fit_result import FitResult, FitValues
from plant_emulator.diagnosis.fitting import approach as approaching
from plant_emulator.diagnosis.fitting.approach import (
    CORRECTION_INTERVALS,
    approach_null,
    fit_null,
    lead,
    let_go,
    nearest,
)
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machine import Model
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import simulate, values_of
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
    near = let_go(model, lead(model, nominal_start(model), RUNS), RUNS)
    found = fit(model, (), RUNS, near.values, near.states)
    assert found.mean_square == pytest.approx(1.0, abs=0.03)
    # tests/data/README.md: what the bench was made with
    assert found.values["drum_inertia"] == pytest.approx(1.006135 * 312.69, rel=0.003)
    assert found.values["backlash_half_gap"] == pytest.approx(
        1.010622 * model.nominal_set.value("backlash_half_gap"), rel=0.003
    )


def test_start_near_the_noise_is_kept(model: BenchModel) -> None:
    near = let_go(model, lead(model, nominal_start(model), RUNS), RUNS)
    reached = fit(model, (), RUNS, near.values, near.states)
    assert nearest(model, [nominal_start(model), reached], RUNS) is reached
    assert nearest(model, [nominal_start(model)], RUNS) is None


@pytest.mark.parametrize(("off", "led"), [(1.0, 0), (1.3, len(CORRECTION_INTERVALS) - 1)])
def test_values_that_leave_noise_are_let_go_at_once(
    model: BenchModel, monkeypatch: pytest.MonkeyPatch, off: float, led: int
) -> None:
    """The right values need no further fit along the measured speeds, and another friction does."""
    near = let_go(model, lead(model, nominal_start(model), RUNS), RUNS)
    right = fit(model, (), RUNS, near.values, near.states)
    friction = {"gear_coulomb_friction": off * right.values["gear_coulomb_friction"]}
    start = replace(right, values={**right.values, **friction})
    intervals = []

    def kept(there: BenchModel, one: FitValues, runs: object, interval: float, most: int) -> object:
        intervals.append(interval)
        return one

    monkeypatch.setattr(approaching, "lead", kept)
    assert let_go(model, start, RUNS) is start
    assert intervals == list(CORRECTION_INTERVALS[len(CORRECTION_INTERVALS) - led :])


def test_bench_near_the_limit_of_its_voltage_is_led_to_the_noise_again(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    """The first way to it takes contact at the wrong time, and ends at 32 times the noise."""
    asked = replace(bench_log("bench_nominal/program1"), source="run")
    values = values_of(nominal) | {"flux_constant_1": 410.03}
    values["gear_viscous_friction"] *= 1.017
    log = simulate(inputs_of(asked), values, gap_position=0.19, step=1e-3)
    found = fit_null(BenchModel([recording(add_noise(log, 91))], nominal, {}), (0,))
    assert found.mean_square == pytest.approx(1.0, abs=0.05)
    assert found.values["flux_constant_1"] == pytest.approx(410.03, rel=0.005)


class Misled(Line):
    """A line that is led along a wave of other sizes, one after the other."""

    led_to: tuple[float, ...] = (4.0,)

    def observer(self, interval: float) -> Line:
        """See `Model`."""
        size, *rest = self.led_to
        self.led_to = tuple(rest) or (size,)
        return Line([noisy(2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME))])


@pytest.mark.parametrize(
    ("led_to", "let_go"),
    [((4.0,), 1), ((0.0,), 2), ((4.0, 4.0, 4.0, 4.0, 4.0, 0.0), 2), ((4.0,) * 5 + (3.9,), 1)],
)
def test_far_fit_is_let_go_again_only_where_it_is_led_nearer(
    led_to: tuple[float, ...], let_go: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: a wave of 4 leaves 8 beside the noise of 1, and one of 3.9 leaves 7.6.

    The sixth fit along the measured outputs is the first one after the fit was let go.
    """
    far: list[float] = []
    go = approaching.let_go

    def noting(model: Model, led: FitResult, runs: Sequence[int]) -> FitValues:
        far.append(led.mean_square)
        return go(model, led, runs)

    monkeypatch.setattr(approaching, "let_go", noting)
    model = Misled([noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME))])
    model.led_to = led_to
    found, led = approach_null(model, (0,))
    assert found.mean_square == pytest.approx(9.0, rel=0.1)
    assert len(far) == let_go
    assert far[0] == pytest.approx(1.0 + led_to[0] ** 2 / 2.0, rel=0.1)
    assert led is not None
    assert led.mean_square == pytest.approx(1.0 + min(led_to) ** 2 / 2.0, rel=0.03)
