"""Effects of the sensors against what they make of the nominal signals by hand."""

from collections.abc import Mapping

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log
from plant_emulator.simulation.simulate import values_of
from tests.plant_emulator.runs import linear, simulate

INPUTS = linear((0.2, 0.0), (1.2, 100.0), (2.0, 100.0), (3.0, 0.0), duration=4.0, period=0.001)
TRUE = ("motor_speed", "drum_speed", "armature_current", "shaft_torque", "armature_voltage")


@pytest.fixture(scope="module")
def plain(nominal: ParameterSet) -> Log:
    return simulate(INPUTS, nominal.values())


def effect(nominal: ParameterSet, name: str, **values: float) -> Mapping[str, float]:
    return values_of(nominal, {name: values})


def others_unchanged(log: Log, plain: Log, signal: str) -> None:
    for name in TRUE:
        if name != signal:
            np.testing.assert_array_equal(log[name], plain[name])


def test_offset_is_added_at_every_torque(nominal: ParameterSet, plain: Log) -> None:
    log = simulate(INPUTS, effect(nominal, "torque_sensor_offset", offset=-0.7))
    np.testing.assert_allclose(log["shaft_torque"], plain["shaft_torque"] - 0.7, atol=1e-12)
    others_unchanged(log, plain, "shaft_torque")


def test_gain_error_is_a_share_of_the_torque(nominal: ParameterSet, plain: Log) -> None:
    log = simulate(INPUTS, effect(nominal, "torque_sensor_gain", error=0.03))
    np.testing.assert_allclose(log["shaft_torque"], 1.03 * plain["shaft_torque"], rtol=1e-12)
    others_unchanged(log, plain, "shaft_torque")


def test_drift_grows_with_the_time_since_the_start(nominal: ParameterSet, plain: Log) -> None:
    log = simulate(INPUTS, effect(nominal, "torque_sensor_drift", rate=0.05))
    expected = plain["shaft_torque"] + 0.05 * INPUTS.time
    np.testing.assert_allclose(log["shaft_torque"], expected, atol=1e-12)
    others_unchanged(log, plain, "shaft_torque")


def test_sensor_with_gain_lag_and_offset_lags_behind_the_amplified_torque(
    nominal: ParameterSet,
) -> None:
    lag = {"torque_sensor_lag": {"time_constant": 0.1}}
    other = {"torque_sensor_gain": {"error": 0.2}, "torque_sensor_offset": {"offset": 1.0}}
    lagging = simulate(INPUTS, values_of(nominal, lag))["shaft_torque"]
    every = simulate(INPUTS, values_of(nominal, {**lag, **other}))["shaft_torque"]
    np.testing.assert_allclose(every, 1.2 * lagging + 1.0, atol=1e-9)


def test_another_wheel_radius_scales_the_drum_speed(nominal: ParameterSet, plain: Log) -> None:
    log = simulate(INPUTS, effect(nominal, "drum_speed_scale", error=-0.012))
    np.testing.assert_allclose(log["drum_speed"], 0.988 * plain["drum_speed"], rtol=1e-12)
    others_unchanged(log, plain, "drum_speed")


@pytest.mark.parametrize("tau", [0.02, 0.2])
def test_lagging_drum_speed_is_the_first_order_filtered_one(
    nominal: ParameterSet, plain: Log, tau: float
) -> None:
    log = simulate(INPUTS, effect(nominal, "drum_speed_lag", time_constant=tau))
    true, expected = plain["drum_speed"], np.zeros(len(INPUTS.time))
    decay = np.exp(-1e-3 / tau)
    for k in range(1, len(true)):
        middle = 0.5 * (true[k] + true[k - 1])
        expected[k] = middle + (expected[k - 1] - middle) * decay
    assert np.abs(log["drum_speed"] - expected).max() < 2e-3 * np.ptp(true)
    others_unchanged(log, plain, "drum_speed")


def test_slipping_measuring_wheel_falls_behind_by_the_acceleration(
    nominal: ParameterSet, plain: Log
) -> None:
    """k = 0.02 s^2/rad: at 1.6 rad/s^2 it shows 3.2 % too little, while braking too much."""
    log = simulate(INPUTS, effect(nominal, "drum_speed_slip", slip_per_acceleration=0.02))
    true = plain["drum_speed"]
    acceleration = np.gradient(true, 1e-3)
    expected = true * (1.0 - 0.02 * acceleration)
    error = np.abs(log["drum_speed"] - expected)  # the quotient smears the jumps at contacts
    assert np.quantile(error, 0.99) < 1e-3 * np.ptp(true)
    ramp = (INPUTS.time > 0.9) & (INPUTS.time < 1.2)
    share = log["drum_speed"][ramp] / true[ramp]
    assert share.mean() == pytest.approx(1.0 - 0.02 * 100.0 / 62.6, abs=3e-3)
    others_unchanged(log, plain, "drum_speed")


def test_slip_that_bends_grows_with_a_power_of_the_acceleration(
    nominal: ParameterSet, plain: Log
) -> None:
    """n = 1/2, k = 0.02: at 1.597 rad/s^2 it shows 0.02 sqrt(1.597) = 2.53 % too little."""
    sizes = {"slip_per_acceleration": 0.02, "exponent": 0.5}
    log = simulate(INPUTS, effect(nominal, "drum_speed_slip", **sizes))
    ramp = (INPUTS.time > 0.9) & (INPUTS.time < 1.2)
    share = log["drum_speed"][ramp] / plain["drum_speed"][ramp]
    assert share.mean() == pytest.approx(1.0 - 0.02 * (100.0 / 62.6) ** 0.5, abs=2e-3)
    others_unchanged(log, plain, "drum_speed")


def test_motor_turns_slower_where_its_tachometer_shows_too_much(nominal: ParameterSet) -> None:
    """The read speed is held at the reference; the drum turns at 1 / (1 + e) of it, over xi."""
    inputs = linear((0.5, 0.0), (2.0, 200.0), duration=30.0)
    log = simulate(inputs, effect(nominal, "motor_speed_scale", error=0.05))
    assert log["motor_speed"][-1] == pytest.approx(200.0, rel=1e-3)
    torque = 35.989 + 345.38 * (200.0 / 1.05 / 62.6) ** 0.4418
    assert -62.6 * log["shaft_torque"][-1] == pytest.approx(torque, rel=1e-3)
