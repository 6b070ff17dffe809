"""Effects at the drum, and between the truck's tyre and it, against calculations by hand."""

from collections.abc import Mapping

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.programs import TravelProgram
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.simulation.simulate import values_of
from plant_emulator.simulation.travel_program import simulate_travel
from tests import reference_plant as thesis
from tests.plant_emulator.runs import DRUM, Piecewise, linear, simulate, with_truck

WIDE = {"backlash_half_gap": 1e3}  # the drum turns freely


def effect(nominal: ParameterSet, name: str, **values: float) -> Mapping[str, float]:
    return values_of(nominal, {name: values})


@pytest.mark.parametrize("speed", [30.0, 300.0, -300.0])
def test_bearing_friction_adds_its_torque_over_the_gear_ratio(
    nominal: ParameterSet, speed: float
) -> None:
    """At a held speed the shaft carries T_f + T_c + b omega_d, over xi."""
    inputs = linear((0.5, 0.0), (6.5, speed), duration=30.0, period=0.05)
    log = simulate(inputs, effect(nominal, "drum_bearing_friction", coulomb=25.0, viscous=6.0))
    omega = speed / thesis.xi
    torque = thesis.friction(omega, sign=np.sign) + np.sign(speed) * 25.0 + 6.0 * omega
    assert -log["shaft_torque"][-40:].mean() == pytest.approx(torque / thesis.xi, rel=1e-3)


def test_free_drum_runs_down_on_its_bearings_and_stops(nominal: ParameterSet) -> None:
    """J omega' = -T_c - b omega from 2 rad/s: omega + T_c / b falls by exp(-b t / J)."""
    values = effect(nominal, "drum_bearing_friction", coulomb=25.0, viscous=6.0)
    bench = Piecewise({**values, **WIDE})
    bench.x[DRUM] = 2.0
    bench.to(10.0, 0.0, pieces=1000)
    expected = (2.0 + 25.0 / 6.0) * np.exp(-6.0 * 10.0 / thesis.J_d) - 25.0 / 6.0
    assert bench.x[DRUM] == pytest.approx(expected, rel=1e-4)
    bench.to(25.0, 0.0, pieces=1500)  # 20.4 s by the same equation
    assert bench.x[DRUM] == 0.0


def test_imbalance_swings_the_free_drum_as_a_pendulum(nominal: ParameterSet) -> None:
    """Small swings: theta = theta_0 cos(sqrt(M / J) t)."""
    values = effect(nominal, "drum_imbalance", moment=50.0, start_angle=0.05)
    bench = Piecewise({**values, **WIDE})
    omega = np.sqrt(50.0 / thesis.J_d)
    for t in (2.0, 5.0, 11.0):
        bench.to(t, 0.0, pieces=round(100 * (t - bench.time)))
        expected = -0.05 * omega * np.sin(omega * t)
        assert bench.x[DRUM] == pytest.approx(expected, abs=2e-3 * 0.05 * omega)


def test_imbalance_shows_in_the_torque_once_a_turn_of_the_drum(nominal: ParameterSet) -> None:
    """Slowly driven, with bearings that keep the flank in contact: (M / xi) sin theta_d."""
    inputs = linear((0.5, 0.0), (1.5, 30.0), duration=40.0, period=0.02)
    bearing = {"drum_bearing_friction": {"coulomb": 200.0, "viscous": 0.0}}
    plain = simulate(inputs, values_of(nominal, bearing))
    both = {**bearing, "drum_imbalance": {"moment": 40.0, "start_angle": 0.0}}
    log = simulate(inputs, values_of(nominal, both))
    angle = np.cumsum(log["drum_speed"]) * 0.02
    assert angle[-1] > 2.5 * np.pi
    steady = log.time > 8.0
    swing = plain["shaft_torque"] - log["shaft_torque"]
    expected = 40.0 / thesis.xi * np.sin(angle)
    assert np.abs(swing - expected)[steady].max() < 0.03 * 40.0 / thesis.xi


# --- the truck's wheel --------------------------------------------------------------------------


def test_slipping_wheel_passes_its_torque_on_later(nominal: ParameterSet) -> None:
    """After a step T of the torque the drum lacks momentum T tau, tau = c J_w r_d omega / r_w^2.

    At 4 rad/s, c = 2e-5 per newton and J_w = 4 kg m^2: tau = 7.0 ms.
    """
    speeds = {}
    for slip in (0.0, 2e-5):
        values = effect(nominal, "wheel_slip", slip_per_force=slip, wheel_inertia=4.0)
        bench = Piecewise({**values, **WIDE}, step=1e-4)
        bench.x[DRUM] = 4.0
        bench.to(0.1, 0.0, wheel_torque=40.0)
        speeds[slip] = bench.x[DRUM]
    tau = 2e-5 * 4.0 * 0.645 * 4.0 / 0.1715**2
    assert tau == pytest.approx(7.0e-3, rel=0.01)
    missing = 645 / 171.5 * 40.0 * tau / thesis.J_d
    assert speeds[0.0] - speeds[2e-5] == pytest.approx(missing, rel=0.02)


def truck_log(nominal: ParameterSet, force: float, torque: float) -> float:
    """Drum speed 2 s after the truck started with that torque at its wheel [rad/s]."""
    inputs = linear((0.0, 0.0), duration=2.1)
    acting = np.where(inputs.time > 0.105, torque, 0.0)
    values = {**effect(nominal, "tyre_rolling_loss", force=force), **WIDE}
    return float(simulate(with_truck(inputs, acting), values)["drum_speed"][-1])


def test_rolling_loss_is_missing_in_the_force_on_the_drum(nominal: ParameterSet) -> None:
    """J_d omega' = (r_d / r_w) T_w - r_d F."""
    torque = 645 / 171.5 * 60.0 - 0.645 * 150.0
    expected = 2.0 * torque / thesis.J_d
    assert truck_log(nominal, 150.0, 60.0) == pytest.approx(expected, rel=1e-4)


def test_truck_that_is_too_weak_for_its_tyres_does_not_move(nominal: ParameterSet) -> None:
    """40 N m at the wheel are 233 N."""
    assert truck_log(nominal, 250.0, 40.0) == 0.0
    assert truck_log(nominal, 220.0, 40.0) > 0.0


def test_without_a_truck_there_is_no_tyre(nominal: ParameterSet) -> None:
    inputs = linear((0.2, 0.0), (1.2, 100.0), duration=2.0)
    plain = simulate(inputs, nominal.values())
    log = simulate(inputs, effect(nominal, "tyre_rolling_loss", force=500.0))
    for name in plain.signals:
        np.testing.assert_array_equal(log[name], plain[name])


@pytest.mark.slow
def test_running_bench_knows_whether_a_truck_stands_on_it(nominal: ParameterSet) -> None:
    loss = {"tyre_rolling_loss": {"force": 500.0}}
    torque = {
        truck: Bench(nominal, loss, truck=truck).advance([0.1 * k for k in range(3000)])
        for truck in (False, True)
    }
    change = torque[True].shaft_torque[-1] - torque[False].shaft_torque[-1]
    assert change == pytest.approx(-500.0 * 0.645 / thesis.xi, rel=0.05)


def test_travel_program_has_its_truck_on_the_drum(nominal: ParameterSet) -> None:
    program = TravelProgram(name="short", duration=4.0, mass=3640.0)
    plain = simulate_travel(program, nominal)
    lossy = simulate_travel(program, nominal, {"tyre_rolling_loss": {"force": 300.0}})
    assert lossy["drum_speed"][-1] < 0.95 * plain["drum_speed"][-1]
