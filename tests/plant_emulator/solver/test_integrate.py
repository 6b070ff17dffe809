"""The stepper: its order, what tolerance buys, and when the reference arrives."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from plant_emulator.errors import UnsettledError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.fit_metrics import validate
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import TOLERANCE
from plant_emulator.simulation.simulate import simulate as simulate_run
from plant_emulator.solver import sdirk
from plant_emulator.solver.kernel import Kernel
from tests.plant_emulator.runs import BACKLASH, CURRENT, DRUM, MOTOR, Piecewise, linear, simulate

# The run that the emulator's design figures were measured on (18 s with contact, gap and rest).
RAMP = ((0.0, 0.0), (5.0, 380.0), (14.0, 380.0), (17.5, 0.0))


def after_a_corner(nominal: ParameterSet, step: float) -> np.ndarray:
    """States 50 ms after a corner of a ramp in contact, below base speed."""
    bench = Piecewise(nominal.values(), gap_position=1.0, tolerance=1e-11)
    bench.to(0.5, 30.0)
    bench.step = step
    bench.to(0.55, 37.5)
    return np.array(bench.x)


def test_stepper_has_order_three(nominal: ParameterSet) -> None:
    exact = after_a_corner(nominal, 1e-5)
    errors = [np.abs(after_a_corner(nominal, step) - exact) for step in (2e-3, 1e-3, 5e-4)]
    for state in (CURRENT, MOTOR, BACKLASH, DRUM):
        orders = [np.log2(coarse[state] / fine[state]) for coarse, fine in pairwise(errors)]
        assert orders == pytest.approx([3.0, 3.0], abs=0.1), state


def test_estimated_error_is_that_of_the_method() -> None:
    """For x' = -x, with the coefficients of Alexander's table: one step by hand."""
    gamma, middle, first, second = 0.4358665215, 0.7179332608, 1.2084966492, -0.6443631707
    h = 0.05
    one = 1.0 / (1.0 + gamma * h)
    two = (1.0 - (middle - gamma) * h * one) / (1.0 + gamma * h)
    three = (1.0 - h * (first * one + second * two)) / (1.0 + gamma * h)
    weights = (sdirk.ERROR_0, sdirk.ERROR_1, sdirk.ERROR_2, sdirk.ERROR_3)
    estimated = sum(-h * w * x for w, x in zip(weights, (1.0, one, two, three), strict=True))
    assert estimated == pytest.approx(three - np.exp(-h), rel=0.2)


def worst(measured: Log, simulated: Log) -> float:
    """Largest NRMSD of the compared channels [%]."""
    return 100.0 * max(fit.nrmsd for fit in validate(measured, simulated).values())


def test_adaptive_error_falls_with_its_tolerance(nominal: ParameterSet) -> None:
    inputs, values = linear(*RAMP, duration=18.0), nominal.values()
    converged = simulate(inputs, values, tolerance=1e-9)
    errors = [
        worst(converged, simulate(inputs, values, tolerance=tolerance))
        for tolerance in (2e-3, 2e-4, TOLERANCE, 2e-6, 2e-7)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[2] < 0.005


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


# --- what effects may do ------------------------------------------------------------------------

LISTENING = """
TIMES = []


def dead_time(value, s, p):
    TIMES.append(s.time)
    return value


def tachometer_gain(value, s, p):
    TIMES.append(s.time) if not TIMES else None
    return value
"""


def test_dead_time_is_asked_for_at_the_begin_of_each_step(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    """Also after a step that was refused, and from the first sample on."""
    model = model_with(LISTENING)
    inputs = linear((0.0, 0.0), (0.3, 60.0), duration=0.5)
    later = Log(inputs.time + 1000.0, inputs.signals, "later")
    times = model.effects["own"].laws["dead_time"].__globals__["TIMES"]
    times.clear()  # of the trial
    simulate(later, nominal.values(), kernel=model)
    assert times[0] == 1000.0
    assert all(a <= b for a, b in pairwise(times))
    assert times[-1] < 1000.5
    assert len(times) > len(set(times))  # some steps were refused


LAWS = (
    ["dead_time", "reference", "speed_limit", "current_limit", "voltage_limit", "tachometer_gain",
     "integration_at_limit", "converter_voltage_drop", "resistance", "flux", "gear_torque",
     "motor_coulomb_friction", "motor_viscous_friction", "motor_shaft_damping",
     "gear_coulomb_friction", "gear_viscous_friction", "backlash_half_gap", "drum_torque",
     "drum_coulomb_friction", "drum_viscous_friction", "measured_drum_speed",
     "measured_armature_current", "measured_shaft_torque", "shell_temperature"]
)  # fmt: skip


@pytest.mark.parametrize(
    ("where", "step"),
    [
        *((law, None) for law in LAWS),
        *((law, 5e-3) for law in ("dead_time", "flux", "drum_torque")),
    ],
)
def test_law_that_is_no_number_is_refused_not_returned(
    nominal: ParameterSet, model_with: Callable[[str], Kernel], where: str, step: float | None
) -> None:
    model = model_with(
        f"def {where}(value, s, p):\n"
        "    return value if s.time < 0.11 else float('nan') * p.own_size"
    )
    inputs = linear((0.0, 0.0), (0.1, 10.0), duration=0.2)
    values = {**nominal.values(), "dead_time": 0.0, "own_size": 1.0}
    with pytest.raises(UnsettledError):
        simulate(inputs, values, kernel=model, step=step)


@pytest.mark.parametrize("name", ["gear_friction_exponent", "drum_inertia", "gear_ratio"])
def test_parameter_that_is_no_number_is_refused(nominal: ParameterSet, name: str) -> None:
    inputs = linear((0.0, 0.0), (0.1, 10.0), duration=0.2)
    with pytest.raises(UnsettledError):
        simulate(inputs, {**nominal.values(), name: float("nan")}, gap_position=1.0)


def test_memory_that_is_no_number_is_refused(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    model = model_with(
        "def start(p):\n    return 0.0\n\n\n"
        "def advance(base, a, s, p):\n    return base if s.time < 0.1 else float('nan')\n\n\n"
        "MEMORIES = {'shown': Memory(start, advance)}\n\n\n"
        "def measured_drum_speed(value, s, p):\n    return value + s.own_shown"
    )
    with pytest.raises(UnsettledError):
        simulate(linear((0.0, 0.0), duration=0.2), nominal.values(), kernel=model)


@pytest.mark.parametrize("before", [0.6e-6, 0.9e-6])
def test_jump_that_counts_as_the_sample_after_it_acts_from_there(
    nominal: ParameterSet, before: float
) -> None:
    """A corner nearer to a sample than the smallest step is taken at the sample."""
    time = 0.01 * np.arange(7)
    inputs = Log(time, {"speed_reference": np.where(time >= 0.03, 1.0, 0.0)}, "by hand")
    on, just_before = (
        simulate_run(inputs_of(inputs, "staircase"), {**nominal.values(), "dead_time": dead_time})
        for dead_time in (0.01, 0.01 - before)
    )
    assert on["armature_current"][4] == 0.0
    assert on["armature_current"][5] > 0.0
    np.testing.assert_array_equal(on["armature_current"], just_before["armature_current"])


# --- samples ------------------------------------------------------------------------------------


def test_every_sample_of_a_fast_log_is_computed_not_interpolated(nominal: ParameterSet) -> None:
    """At 1 kHz no step passes over a sample."""
    fast = linear((0.1, 0.0), (0.5, 80.0), duration=1.0, period=1e-3)
    as_it_is = simulate(fast, nominal.values())
    landing = simulate(fast, nominal.values(), largest_step=1e-3)
    for name in COMPARED:
        np.testing.assert_array_equal(as_it_is[name], landing[name])


def test_slow_log_is_not_stepped_longer_than_a_hundredth_of_a_second(
    nominal: ParameterSet,
) -> None:
    slow = linear((0.1, 0.0), (0.5, 80.0), duration=1.0, period=0.1)
    as_it_is, by_hand = (
        simulate(slow, nominal.values(), **options) for options in ({}, {"largest_step": 0.01})
    )
    np.testing.assert_array_equal(as_it_is["armature_current"], by_hand["armature_current"])
