"""The oil's temperature against a heat balance by hand."""

from math import exp

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.simulate import values_of
from tests.plant_emulator.runs import linear, simulate

OIL = {
    "viscosity_coefficient": 0.02,
    "start_temperature": 288.15,
    "nominal_temperature": 313.15,
    "shell_temperature": 290.15,
    "heat_capacity": 2e4,
    "shell_conductance": 60.0,
}
INPUTS = linear((0.5, 0.0), (4.5, 350.0), duration=120.0)


def test_friction_follows_the_heat_balance(nominal: ParameterSet) -> None:
    """C dT/dt = T_f omega - G (T - T_shell) along the simulated speed, by Euler's method."""
    log = simulate(INPUTS, values_of(nominal, {"gear_oil_temperature": OIL}))
    temperature = 288.15
    friction = np.zeros(len(log.time))
    for k, omega in enumerate(log["motor_speed"] / 62.6):
        factor = exp(-0.02 * (temperature - 313.15))
        friction[k] = 35.989 + factor * 345.38 * abs(omega) ** 0.4418
        temperature += 0.01 / 2e4 * (friction[k] * omega - 60.0 * (temperature - 290.15))
    assert temperature > 300.0  # it has warmed by more than 12 K
    steady = log.time > 60.0  # the drum has settled in its gap
    assert -62.6 * log["shaft_torque"][steady] == pytest.approx(friction[steady], rel=2e-3)


def test_cold_oil_multiplies_the_viscous_friction_by_the_exponential(
    nominal: ParameterSet,
) -> None:
    """25 K below the nominal temperature: exp(0.5). A huge heat capacity holds it there."""
    cold = {**OIL, "heat_capacity": 1e7}
    log = simulate(INPUTS, values_of(nominal, {"gear_oil_temperature": cold}))
    expected = 35.989 + exp(0.5) * 345.38 * (350.0 / 62.6) ** 0.4418
    assert -62.6 * log["shaft_torque"][-1] == pytest.approx(expected, rel=5e-3)


def test_oil_settles_where_the_losses_go_through_the_shell(nominal: ParameterSet) -> None:
    quick = {**OIL, "heat_capacity": 1e3}  # time constant below 17 s
    log = simulate(INPUTS, values_of(nominal, {"gear_oil_temperature": quick}))
    omega, friction = log["motor_speed"][-1] / 62.6, -62.6 * log["shaft_torque"][-1]
    oil = 290.15 + friction * omega / 60.0
    expected = 35.989 + exp(-0.02 * (oil - 313.15)) * 345.38 * omega**0.4418
    assert friction == pytest.approx(expected, rel=1e-4)


def test_friction_that_does_not_know_the_temperature_is_the_nominal_one(
    nominal: ParameterSet,
) -> None:
    indifferent = {**OIL, "viscosity_coefficient": 0.0}
    inputs = linear((0.5, 0.0), (2.0, 200.0), duration=4.0)
    plain = simulate(inputs, nominal.values())
    found = simulate(inputs, values_of(nominal, {"gear_oil_temperature": indifferent}))
    for name in plain.signals:
        np.testing.assert_array_equal(plain[name], found[name])


def test_shell_shows_its_temperature(nominal: ParameterSet) -> None:
    inputs = linear((0.0, 0.0), duration=0.1)
    log = simulate(inputs, values_of(nominal, {"gear_oil_temperature": OIL}))
    assert log["shell_temperature"] == pytest.approx(290.15)
