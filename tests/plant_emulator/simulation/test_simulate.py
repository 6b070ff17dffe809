"""Against the independent bench: logs made by another implementation with another integrator."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.fit_metrics import validate
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.simulation.start_in_gap import fit_start, mean_square_residual
from tests.plant_emulator.runs import linear, with_truck

ReadLog = Callable[[str], Log]

# program -> largest NRMSD of a channel [%]
LIMITS = {
    "program1": 0.02,
    "program2": 0.02,
    "program3": 0.02,
    "program4": 0.5,
    "program6": 0.15,
    "program6L": 0.15,
}
NOISE = {"motor_speed": 0.15, "drum_speed": 0.01, "armature_current": 0.25, "shaft_torque": 0.25}

# How practice_003 was made (tests/data/README.md), percent of the nominal value.
DRIFT_003 = {
    "gear_viscous_friction": -3.3010,
    "gear_coulomb_friction": 4.0259,
    "gear_friction_exponent": 0.4418,
    "drum_inertia": 2.2549,
    "drum_shaft_damping": 0.3310,
    "backlash_half_gap": 3.3678,
    "dead_time": -2.9689,
    "flux_constant_1": -0.1696,
    "flux_constant_2": -15.3571,
}


@pytest.mark.parametrize("program", LIMITS)
def test_every_channel_follows_the_independent_bench(
    nominal: ParameterSet, bench_log: ReadLog, program: str
) -> None:
    log = bench_log(f"bench_nominal/{program}")
    fits = validate(log, simulate(inputs_of(log), nominal.values()))
    assert set(fits) == set(COMPARED)
    for channel, fit in fits.items():
        assert 100.0 * fit.nrmsd <= LIMITS[program], (channel, 100.0 * fit.nrmsd)


@pytest.mark.parametrize("program", ["program1", "program2", "program3"])
def test_noisy_log_without_effect_leaves_only_the_sensors_noise(
    nominal: ParameterSet, bench_log: ReadLog, program: str
) -> None:
    log = bench_log(f"bench_practice/practice_004/{program}")
    for channel, fit in validate(log, simulate(inputs_of(log), nominal.values())).items():
        assert fit.rms <= 1.1 * NOISE[channel], (channel, fit.rms)


@pytest.mark.parametrize("program", ["program1", "program2", "program3"])
def test_lagging_sensor_of_the_independent_bench_is_ours(
    nominal: ParameterSet, bench_log: ReadLog, program: str
) -> None:
    """The drifted parameters and the lag as planted, the start position fitted."""
    log = bench_log(f"bench_practice/practice_003/{program}")
    drifted = {n: nominal.value(n) * (1 + percent / 100) for n, percent in DRIFT_003.items()}
    lag = {"torque_sensor_lag": {"time_constant": 0.1}}
    values = values_of(nominal.with_values(drifted), lag)
    run = inputs_of(log)
    position = fit_start(log, run, values)
    for channel, fit in validate(log, simulate(run, values, gap_position=position)).items():
        assert fit.rms <= 1.1 * NOISE[channel], (channel, fit.rms)


def test_start_in_the_middle_is_found_in_the_independent_log(
    nominal: ParameterSet, bench_log: ReadLog
) -> None:
    log = bench_log("bench_nominal/program1")
    assert fit_start(log, inputs_of(log), nominal.values()) == pytest.approx(0.0, abs=0.002)


@pytest.mark.parametrize("position", [-1.0, -0.37, 0.62, 1.0])
def test_start_position_is_found_again(nominal: ParameterSet, position: float) -> None:
    inputs = linear((0.5, 0.0), (2.5, 150.0), (4.0, 150.0), (5.0, 40.0), duration=6.0)
    values = nominal.values()
    log = simulate(inputs_of(inputs), values, gap_position=position)
    assert fit_start(log, inputs_of(log), values) == pytest.approx(position, abs=0.01)


def test_whitened_residual_of_one_noise_is_one(bench_log: ReadLog) -> None:
    log = bench_log("bench_nominal/program1")
    off = {name: log[name] + NOISE[name] for name in COMPARED}
    assert mean_square_residual(log, Log(log.time, off)) == pytest.approx(1.0)


# --- what holds between samples ---------------------------------------------------------------


def test_reference_is_linear_between_samples_without_a_truck() -> None:
    run = inputs_of(linear((0.0, 0.0), (1.0, 10.0), duration=1.0, period=0.1))
    assert run.slope[:-1] == pytest.approx(10.0)
    assert not run.truck


def test_reference_is_a_staircase_with_a_truck_unless_overridden() -> None:
    inputs = linear((0.0, 0.0), (1.0, 10.0), duration=1.0, period=0.1)
    log = with_truck(inputs, np.zeros(11))
    assert not inputs_of(log).slope.any()
    assert inputs_of(log).corners == pytest.approx(0.1 * np.arange(1, 11))
    assert inputs_of(log, "linear").slope[:-1] == pytest.approx(10.0)
    assert not inputs_of(inputs, "staircase").slope.any()


def test_corners_are_where_the_slope_changes() -> None:
    run = inputs_of(
        linear((0.2, 0.0), (0.5, 30.0), (0.8, 30.0), (1.0, 0.0), duration=1.0, period=0.1)
    )
    assert run.corners == pytest.approx([0.2, 0.5, 0.8])


def test_truck_is_parked_until_its_torque_leaves_the_noise() -> None:
    inputs = linear((0.0, 0.0), duration=0.4, period=0.1)
    run = inputs_of(with_truck(inputs, np.array([1.0, -4.0, 3.0, 200.0, 0.0])))
    assert run.parked.tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]


def test_truck_that_never_starts_stays_parked() -> None:
    inputs = linear((0.0, 0.0), duration=0.2, period=0.1)
    assert inputs_of(with_truck(inputs, np.zeros(3))).parked.all()


def test_log_of_a_run_without_truck_has_no_wheel_torque(nominal: ParameterSet) -> None:
    inputs = linear((0.1, 0.0), (0.2, 5.0), duration=0.5)
    assert "wheel_torque" not in simulate(inputs_of(inputs), nominal.values())


def test_simulated_run_simulated_again_is_the_same(nominal: ParameterSet) -> None:
    inputs = linear((0.1, 0.0), (1.0, 80.0), duration=2.0)
    once = simulate(inputs_of(inputs), nominal.values())
    again = simulate(inputs_of(once), nominal.values())
    for name in COMPARED:
        np.testing.assert_array_equal(once[name], again[name])


def test_wheel_torque_acts_during_the_interval_that_ends_at_its_sample(
    nominal: ParameterSet,
) -> None:
    inputs = linear((0.0, 0.0), duration=0.3, period=0.1)
    log = with_truck(inputs, np.array([0.0, 0.0, 50.0, 0.0]))
    drum = simulate(inputs_of(log), nominal.values())["drum_speed"]
    gained = 0.645 / 0.1715 * 50.0 / 312.69 * 0.1
    assert drum == pytest.approx([0.0, 0.0, gained, gained])
