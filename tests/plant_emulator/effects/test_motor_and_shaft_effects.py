"""Effects of the motor and of its shaft against calculations by hand."""

from collections.abc import Mapping
from math import sqrt

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.simulate import values_of
from tests import reference_plant as thesis
from tests.plant_emulator.runs import GEAR, MOTOR, TWIST, Piecewise, linear, simulate


def effect(nominal: ParameterSet, name: str, **values: float) -> Mapping[str, float]:
    return values_of(nominal, {name: values})


@pytest.mark.parametrize("speed", [60.0, 250.0, 400.0, -250.0])
def test_motor_keeps_its_own_friction_from_the_shaft(nominal: ParameterSet, speed: float) -> None:
    """k Phi i - T_mg = T_c + k omega^2 at a steady speed: 0.6 + 0.6 (omega / 400)^2."""
    inputs = linear((0.5, 0.0), (6.5, speed), duration=40.0, period=0.05)
    values = effect(nominal, "motor_friction", coulomb=0.6, windage=0.6 / 400.0**2)
    log = simulate(inputs, values)
    last = slice(-40, None)
    torque = thesis.k_phi(speed) * log["armature_current"][last] + log["shaft_torque"][last]
    expected = np.sign(speed) * (0.6 + 0.6 * (speed / 400.0) ** 2)
    assert torque.mean() == pytest.approx(expected, rel=5e-3)


def test_motor_friction_holds_the_motor_at_rest(nominal: ParameterSet) -> None:
    """It breaks away once the current's torque exceeds its own level and that of the gear."""
    bench = Piecewise(effect(nominal, "motor_friction", coulomb=2.0))
    torque = 0.0
    for k in range(1, 3000):
        channels = bench.to(1e-3 * k, 1e-4 * k)
        if abs(bench.x[GEAR]) > 0.0:
            break
        torque = thesis.K_m * float(channels[-1, 2])
    assert torque == pytest.approx(2.0 + thesis.f_gc / thesis.xi, rel=0.02)


@pytest.mark.parametrize("speed", [100.0, 350.0, -100.0])
def test_loaded_motor_needs_more_current_for_its_torque(
    nominal: ParameterSet, speed: float
) -> None:
    """T = k Phi_0 (1 - 0.2 |i| / 72 A) i."""
    inputs = linear((0.5, 0.0), (6.5, speed), duration=40.0, period=0.05)
    log = simulate(inputs, effect(nominal, "armature_reaction", share=0.2))
    current = log["armature_current"][-40:]
    torque = thesis.k_phi(speed) * (1.0 - 0.2 * np.abs(current) / 72.0) * current
    assert -log["shaft_torque"][-40:].mean() == pytest.approx(torque.mean(), rel=1e-3)


@pytest.mark.parametrize("tau", [0.05, 0.3])
def test_flux_is_the_first_order_filtered_one_of_the_speed(
    nominal: ParameterSet, tau: float
) -> None:
    """Read off the armature: k Phi = (u - R_a i - L_a di/dt) / omega."""
    inputs = linear((0.1, 0.0), (2.1, 400.0), (3.0, 400.0), duration=3.5, period=1e-3)
    log = simulate(inputs, effect(nominal, "field_lag", time_constant=tau))
    speed, current = log["motor_speed"], log["armature_current"]
    wanted = np.array([thesis.k_phi(w) for w in speed])
    expected = np.full_like(wanted, thesis.K_m)
    decay = np.exp(-1e-3 / tau)
    for k in range(1, len(wanted)):
        middle = 0.5 * (wanted[k] + wanted[k - 1])
        expected[k] = middle + (expected[k - 1] - middle) * decay
    voltage = log["armature_voltage"] - thesis.R_a * current
    flux = (voltage - thesis.L_a * np.gradient(current, 1e-3)) / np.where(speed > 50.0, speed, 1.0)
    moving = slice(700, 3400)
    assert np.abs(flux - expected)[moving].max() < 5e-3 * thesis.K_m
    assert np.abs(wanted - expected)[moving].max() > 0.02 * thesis.K_m


def test_resistance_follows_the_heat_balance_of_the_winding(nominal: ParameterSet) -> None:
    """C dtheta/dt = R_a i^2 - G theta along the simulated current, by Euler's method."""
    heat = {"temperature_coefficient": 0.0039, "start_rise": 10.0, "heat_capacity": 60.0,
            "conductance": 0.3}  # fmt: skip
    inputs = linear((0.5, 0.0), (4.5, 250.0), duration=40.0)
    log = simulate(inputs, effect(nominal, "armature_resistance_heating", **heat))
    rise = 10.0
    for current in log["armature_current"]:
        warm = thesis.R_a * (1.0 + 0.0039 * rise)
        rise += 0.01 / 60.0 * (warm * current**2 - 0.3 * rise)
    assert rise > 25.0
    current, speed = log["armature_current"][-1], log["motor_speed"][-1]
    shown = (log["armature_voltage"][-1] - thesis.k_phi(speed) * speed) / current
    assert shown == pytest.approx(thesis.R_a * (1.0 + 0.0039 * rise), rel=2e-3)


@pytest.mark.parametrize("damping", [0.0, 5.0, 40.0])
def test_motor_swings_against_the_held_gear_as_a_damped_oscillator(
    nominal: ParameterSet, damping: float
) -> None:
    """J_m phi'' + d phi' + k phi = 0; the gear's friction holds it, the field is off."""
    values = {**effect(nominal, "shaft_damping", damping=damping), "flux_constant": 1e-9}
    bench = Piecewise(values, step=5e-6)
    bench.x[TWIST] = 6e-6
    rate = damping / (2.0 * thesis.J_m)
    omega = sqrt(thesis.k_mg / thesis.J_m - rate**2)
    for k in range(1, 9):
        t = 1e-3 * k
        bench.to(t, 0.0)
        wave = np.cos(omega * t) + rate / omega * np.sin(omega * t)
        assert bench.x[TWIST] == pytest.approx(6e-6 * np.exp(-rate * t) * wave, abs=3e-8)
        assert bench.x[GEAR] == 0.0
    assert bench.x[MOTOR] != 0.0
