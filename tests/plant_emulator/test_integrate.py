"""The stepper: its order, what tolerance buys, and when the reference arrives."""

from itertools import pairwise

import numpy as np
import pytest

from plant_emulator.log import COMPARED, Log
from plant_emulator.parameters import ParameterSet
from plant_emulator.programs import PROGRAMS, SpeedProgram
from plant_emulator.validate import validate
from tests.plant_emulator.runs import BACKLASH, CURRENT, DRUM, MOTOR, Piecewise, linear, simulate

# The run that the emulator's design figures were measured on (18 s with contact, gap and rest).
RAMP = ((0.0, 0.0), (5.0, 380.0), (14.0, 380.0), (17.5, 0.0))


def end_of_smooth_stretch(nominal: ParameterSet, step: float | None) -> np.ndarray:
    """0.4 s of a ramp in contact, below base speed, whose fast modes have died out."""
    bench = Piecewise(nominal.values(), gap_position=1.0, tolerance=1e-9)
    bench.to(0.5, 30.0)
    bench.step = step
    bench.to(0.9, 60.0)
    return np.array(bench.x)


def test_stepper_has_order_two(nominal: ParameterSet) -> None:
    exact = end_of_smooth_stretch(nominal, 2e-5)
    errors = [np.abs(end_of_smooth_stretch(nominal, step) - exact) for step in (4e-3, 2e-3, 1e-3)]
    for state in (CURRENT, MOTOR, BACKLASH, DRUM):
        orders = [np.log2(coarse[state] / fine[state]) for coarse, fine in pairwise(errors)]
        assert orders == pytest.approx([2.0, 2.0], abs=0.1), state


def worst(measured: Log, simulated: Log) -> float:
    """Largest NRMSD of the compared channels [%]."""
    return 100.0 * max(fit.nrmsd for fit in validate(measured, simulated).values())


def test_adaptive_error_falls_with_its_tolerance(nominal: ParameterSet) -> None:
    inputs, values = linear(*RAMP, duration=18.0), nominal.values()
    converged = simulate(inputs, values, tolerance=1e-9)
    errors = [
        worst(converged, simulate(inputs, values, tolerance=tolerance))
        for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[3] < 0.002  # the default


def test_fixed_step_error_falls_with_the_step(nominal: ParameterSet) -> None:
    inputs, values = linear(*RAMP, duration=18.0), nominal.values()
    converged = simulate(inputs, values, tolerance=1e-9)
    errors = [worst(converged, simulate(inputs, values, step=h)) for h in (1e-2, 2e-3, 1e-3, 2e-4)]
    assert errors == sorted(errors, reverse=True)
    assert errors[2] <= 0.01


@pytest.mark.parametrize("name", ["program1", "program2", "program3"])
def test_one_millisecond_steps_agree_with_adapted_ones(nominal: ParameterSet, name: str) -> None:
    program = PROGRAMS[name]
    assert isinstance(program, SpeedProgram)
    time, reference = program.reference()
    inputs = Log(time, {"speed_reference": reference}, name)
    adapted = simulate(inputs, nominal.values())
    assert worst(adapted, simulate(inputs, nominal.values(), step=1e-3)) <= 0.05


def test_reference_arrives_after_63_947_milliseconds(nominal: ParameterSet) -> None:
    """Sampled every microsecond around the arrival; corners nearer than that count as one."""
    dense = 0.563947 + 1e-6 * np.arange(-10, 11)
    time = np.concatenate([[0.0, 0.5], dense, [0.6]])
    reference = np.where(time > 0.5, 1e4 * (time - 0.5), 0.0)
    log = simulate(Log(time, {"speed_reference": reference}), nominal.values())
    first = time[np.argmax(log["armature_current"] != 0.0)]
    assert first == pytest.approx(0.563947, abs=1.5e-6)


def test_dead_time_shifts_the_run_and_changes_nothing_else(nominal: ParameterSet) -> None:
    values = nominal.values()
    late = simulate(linear((0.1, 0.0), (1.0, 150.0), duration=2.0), {**values, "dead_time": 0.05})
    soon = simulate(linear((0.1, 0.0), (1.0, 150.0), duration=2.0), {**values, "dead_time": 0.0})
    for name in COMPARED:
        scale = np.ptp(soon[name])
        np.testing.assert_allclose(late[name][5:], soon[name][:-5], rtol=0.0, atol=1e-4 * scale)


def test_reference_before_the_first_sample_is_that_sample(nominal: ParameterSet) -> None:
    log = simulate(linear((0.0, 0.0), (0.2, 20.0), duration=0.3), nominal.values())
    assert not log["motor_speed"][:6].any()


def test_log_may_start_at_any_time(nominal: ParameterSet) -> None:
    inputs = linear((0.1, 0.0), (0.5, 80.0), duration=1.0)
    later = Log(inputs.time + 1000.0, inputs.signals, "later")
    here, there = simulate(inputs, nominal.values()), simulate(later, nominal.values())
    np.testing.assert_allclose(here["motor_speed"], there["motor_speed"], rtol=0.0, atol=1e-3)


def test_unevenly_sampled_log_is_the_evenly_sampled_run_at_its_samples(
    nominal: ParameterSet,
) -> None:
    even = linear((0.1, 0.0), (0.5, 80.0), duration=1.0)
    chosen = np.random.default_rng(1).choice(np.arange(1, 100), 40)
    kept = np.unique([0, 10, 50, 100, *chosen])  # the corners among them
    uneven = Log(even.time[kept], {"speed_reference": even["speed_reference"][kept]}, "uneven")
    whole, part = simulate(even, nominal.values()), simulate(uneven, nominal.values())
    for name in COMPARED:
        scale = np.ptp(whole[name])
        np.testing.assert_allclose(part[name], whole[name][kept], rtol=0.0, atol=2e-4 * scale)
