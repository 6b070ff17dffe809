"""Declared sensors against filters and tasks made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.sensors import SENSED, Sensor
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Array, Log
from plant_emulator.simulation import simulate as level
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.simulation.sensing import lag, phase_of, reference_nodes
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.simulate import values_of
from plant_emulator.workflows.simulation import simulate
from tests.plant_emulator.runs import linear

INPUTS = linear((0.2, 0.0), (1.2, 100.0), (2.0, 100.0), (3.0, 0.0), duration=4.0)
SLOW = {"shaft_torque": Sensor(time_constant=0.05)}


def shown(nominal: ParameterSet, inputs: Log = INPUTS, **sensors: Sensor) -> Log:
    return level.simulate(inputs_of(inputs, sensors=sensors), nominal.values())


def test_lag_of_a_step_and_of_a_ramp_is_the_solution_of_its_equation() -> None:
    """tau y' + y = u: 1 - exp(-t / tau) after a step, t - tau (1 - exp(-t / tau)) on a ramp."""
    time = np.cumsum([0.0, 0.003, 0.01, 0.02, 0.001, 0.1])
    step = lag(np.ones(6), np.diff(time), 0.02, 0.0)
    np.testing.assert_allclose(step, 1.0 - np.exp(-time / 0.02), atol=1e-12)
    ramp = lag(time, np.diff(time), 0.02, 0.0)
    np.testing.assert_allclose(ramp, time - 0.02 * (1.0 - np.exp(-time / 0.02)), atol=1e-12)


@pytest.mark.parametrize("channel", SENSED)
def test_every_channel_is_shown_through_its_own_lag(nominal: ParameterSet, channel: str) -> None:
    """Filtered by scipy; simulated every millisecond, between which the quantity is linear."""
    fine = linear((0.2, 0.0), (1.2, 100.0), (2.0, 100.0), (3.0, 0.0), duration=4.0, period=0.001)
    true = shown(nominal, fine)
    found = shown(nominal, fine, **{channel: Sensor(time_constant=0.05)})
    expected = lsim(([1.0], [0.05, 1.0]), true[channel], fine.time)[1]
    np.testing.assert_allclose(found[channel], expected, atol=1e-9 * np.ptp(true[channel]))
    for other in SENSED.keys() - {channel}:
        np.testing.assert_array_equal(found[other], true[other])


def test_declared_lag_is_the_effects_lag_within_a_tenth_of_the_noise(
    nominal: ParameterSet,
) -> None:
    """The effect follows the torque within the solver; a log of 10 ms shows spikes of contact."""
    effect = {"torque_sensor_lag": {"time_constant": 0.05}}
    expected = level.simulate(inputs_of(INPUTS), values_of(nominal, effect))
    left = shown(nominal, **SLOW)["shaft_torque"] - expected["shaft_torque"]
    assert np.sqrt(np.mean(left**2)) < 0.1 * SENSORS["shaft_torque"][0]


def test_slow_task_reads_every_period_and_holds(nominal: ParameterSet) -> None:
    true = shown(nominal)["drum_speed"]
    found = shown(nominal, drum_speed=Sensor(period=0.04))["drum_speed"]
    expected = true[4 * (np.arange(len(true)) // 4)]
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_task_between_the_samples_shows_its_age(nominal: ParameterSet) -> None:
    """Readings at 0, 15, 30 ms: the samples at 10, 20, 30 ms show those of 0, 15, 30 ms."""
    fine = linear((0.2, 0.0), (1.2, 100.0), (2.0, 100.0), (3.0, 0.0), duration=4.0, period=0.005)
    true = shown(nominal, fine)["motor_speed"]
    found = shown(nominal, motor_speed=Sensor(period=0.015))["motor_speed"]
    read = np.floor(INPUTS.time / 0.015 + 1e-6) * 0.015
    np.testing.assert_allclose(found, np.interp(read, fine.time, true), atol=1e-3)


@pytest.mark.parametrize("phase", [0.0, 0.01, 0.02])
@pytest.mark.parametrize("period", [0.03, 0.025])
def test_phase_of_a_task_is_read_off_the_log(period: float, phase: float) -> None:
    time = 0.01 * np.arange(400)
    values = np.floor((time - phase) / period + 1e-6)
    found = phase_of(Log(time, {"drum_speed": values}), "drum_speed", period)
    readings = np.floor((time - found) / period + 1e-6)
    np.testing.assert_array_equal(np.diff(readings) > 0.0, np.diff(values) > 0.0)


def test_only_new_readings_count_and_a_declared_noise_is_taken(nominal: ParameterSet) -> None:
    bench = replace(nominal, sensors={"drum_speed": Sensor(period=0.02, noise=0.03)})
    log = simulate("program1", parameters=bench, seed=1)
    found = recording(log, sensors=bench.sensors)
    row = found.channels.index("drum_speed")
    assert found.noise[row] == 0.03
    assert found.use[row].mean() == pytest.approx(0.5, abs=0.01)
    assert found.use[found.channels.index("motor_speed")].all()
    fresh = log["drum_speed"][1:][np.diff(log["drum_speed"]) != 0.0]
    assert len(fresh) < 0.51 * len(log.time)


def test_declared_noise_has_its_deviation_in_the_log(nominal: ParameterSet) -> None:
    bench = replace(nominal, sensors={"shaft_torque": Sensor(noise=2.0)})
    noisy, plain = (simulate("program1", parameters=bench, seed=seed) for seed in (1, None))
    assert np.std(noisy["shaft_torque"] - plain["shaft_torque"]) == pytest.approx(2.0, rel=0.05)
    assert np.std(noisy["motor_speed"] - plain["motor_speed"]) == pytest.approx(0.15, rel=0.05)


@pytest.mark.parametrize("sensor", [Sensor(time_constant=0.05), Sensor(period=0.02)])
def test_running_bench_shows_what_a_simulation_shows(nominal: ParameterSet, sensor: Sensor) -> None:
    """Both in steps of 1 ms from rest; the blocks of a scan leave no trace."""
    fine = linear((0.2, 0.0), (1.2, 100.0), duration=2.0, period=0.001)
    bench = replace(nominal, sensors={"shaft_torque": sensor})
    expected = shown(bench, fine, **bench.sensors)["shaft_torque"]
    found = advance(Bench(bench), fine["speed_reference"][1:])
    nothing = shown(nominal, fine)["shaft_torque"] - advance(
        Bench(nominal), fine["speed_reference"][1:]
    )
    assert np.abs(found - expected).max() < np.abs(nothing).max() + 1e-9


def test_serving_a_set_with_noise_shows_it_and_holds_it(nominal: ParameterSet) -> None:
    sensor = Sensor(period=0.004, noise=0.5)
    bench = replace(nominal, sensors={"shaft_torque": sensor})
    found = advance(Bench(bench, seed=0), np.zeros(4000))[1:]
    assert np.std(found) == pytest.approx(0.5, rel=0.1)
    assert np.mean(np.diff(found) == 0.0) == pytest.approx(0.75, abs=0.01)


def advance(bench: Bench, references: Array) -> Array:
    """Shaft torque of the running bench, in blocks of ten steps, with the start at rest."""
    blocks = references.reshape(-1, 10)
    rows = [bench.advance(block.tolist()).shaft_torque for block in blocks]
    return np.concatenate([[0.0], *rows])


def test_without_declared_sensors_no_bit_changes(nominal: ParameterSet) -> None:
    plain, declared = shown(nominal), shown(nominal, shaft_torque=Sensor(noise=1.0))
    for name in plain.signals:
        np.testing.assert_array_equal(plain[name], declared[name])


def test_reference_has_up_to_three_knees_between_two_samples() -> None:
    """A knee at 0 s is none, and so is one at the knee before it, or beyond the next sample."""
    knees = {
        "reference_knee_time": [0.003, 0.01, 0.0],
        "reference_knee": [5.0, 6.0, 0.0],
        "reference_knee_2_time": [0.0, 0.01, 0.0],
        "reference_knee_2": [0.0, 6.0, 0.0],
        "reference_knee_3_time": [0.02, 0.013, 0.0],
        "reference_knee_3": [9.0, 8.0, 0.0],
    }
    signals = {"speed_reference": np.array([1.0, 2.0, 9.0])}
    signals |= {name: np.array(values) for name, values in knees.items()}
    time, value = reference_nodes(Log(time=np.array([0.0, 0.01, 0.03]), signals=signals))
    assert time == pytest.approx([0.0, 0.003, 0.01, 0.02, 0.023, 0.03])
    assert value == pytest.approx([1.0, 5.0, 2.0, 6.0, 8.0, 9.0])
