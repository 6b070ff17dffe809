"""The truck on the road against hand calculation, and the whitening of its residual."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.road_load.kernel import compile_loop, predict_walk
from plant_emulator.road_load.random_walk_filter import whitener
from plant_emulator.road_load.truck_model import RoadParameters, Truck, velocity

# Round numbers: xi / (r_w m) = 10 / (0.2 * 1000) = 0.05 m/s^2 per N m; g C_rr = 0.0981 m/s^2.
TRUCK = Truck(mass=1000.0, ratio=10.0, wheel_radius=0.2, drum_radius=0.5)
LEVEL = RoadParameters(
    crr=0.01,
    crr_v=0.0,
    efficiency=0.8,
    torque_gain=1.0,
    torque_offset=0.0,
    clock_ahead=0.0,
    clock_skew=0.0,
    initial_velocity=0.0,
)
PERIOD = 0.01


def simulate(torque: list[float] | np.ndarray, parameters: RoadParameters = LEVEL) -> np.ndarray:
    shown = np.asarray(torque, dtype=float)
    return velocity(parameters, TRUCK, shown, np.zeros(len(shown), dtype=bool), PERIOD)


def test_driving_torque_loses_in_the_gear() -> None:
    """0.05 * 0.8 * 20 - 0.0981 = 0.7019 m/s^2, for 1 s."""
    assert simulate(np.full(101, 20.0))[-1] == pytest.approx(0.7019)


def test_braking_torque_gains_in_the_gear() -> None:
    """From 5 m/s: 0.05 * 20 / 0.8 + 0.0981 = 1.3481 m/s^2 of braking, for 1 s."""
    end = simulate(np.full(101, -20.0), replace(LEVEL, initial_velocity=5.0))[-1]
    assert end == pytest.approx(5.0 - 1.3481)


def test_backward_travel_is_the_mirror_of_forward_travel() -> None:
    torque = 20.0 * np.sin(np.arange(800) / 100.0)
    assert np.array_equal(simulate(-torque), -simulate(torque))


def test_coasting_truck_loses_its_speed_to_the_road_alone() -> None:
    """dv/dt = -g (C_rr + C_rr,v v / r_d) has the solution of a first-order lag towards -v0."""
    parameters = replace(LEVEL, initial_velocity=4.0, crr_v=1e-3)
    rate, shift = 9.81 * 1e-3 / 0.5, 0.01 * 0.5 / 1e-3
    expected = (4.0 + shift) * np.exp(-rate * 10.0) - shift
    assert simulate(np.zeros(1001), parameters)[-1] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("torque", "moves"), [(2.4, False), (2.5, True), (-2.5, True)])
def test_standing_truck_stays_until_its_motor_overcomes_the_road(
    torque: float, moves: bool
) -> None:
    """0.0981 / (0.05 * 0.8) = 2.4525 N m."""
    assert bool(np.any(simulate(np.full(50, torque)))) is moves


def test_braked_truck_stops_and_stays() -> None:
    """From 1 m/s against 0.1606 m/s^2 it stands after 6.23 s; 1 N m does not push it back."""
    found = simulate(np.full(1000, -1.0), replace(LEVEL, initial_velocity=1.0))
    stop = 1.0 / (0.05 / 0.8 + 0.0981)
    assert np.flatnonzero(found == 0.0)[0] * PERIOD == pytest.approx(stop, abs=PERIOD)
    assert not found[700:].any()


def test_truck_that_turns_round_within_a_sample_goes_on_with_the_torque_of_driving() -> None:
    """It stops after 2 of 10 ms. 0.05 * 0.8 * 100 - 0.0981 m/s^2 accelerate it for 8 ms."""
    start = (0.05 * 100.0 / 0.8 + 0.0981) * 0.002
    found = simulate([-100.0, -100.0], replace(LEVEL, initial_velocity=start))
    assert found[1] == pytest.approx(-(0.05 * 0.8 * 100.0 - 0.0981) * 0.008)


def test_gain_and_offset_of_the_load_cell_are_corrected() -> None:
    torque = 20.0 * np.sin(np.arange(800) / 100.0)
    shown = replace(LEVEL, torque_gain=1.1, torque_offset=-3.0)
    assert simulate(1.1 * torque - 3.0, shown) == pytest.approx(simulate(torque))


def test_held_truck_stands_whatever_its_motor_does() -> None:
    held = np.arange(200) < 100
    found = velocity(LEVEL, TRUCK, np.full(200, 20.0), held, PERIOD)
    assert not found[:100].any()
    assert found[-1] == pytest.approx(100 * PERIOD * 0.7019)


def test_predicted_walk_by_hand() -> None:
    """Gain 1/2: first 0, then half of 4, then 2 + half of (8 - 2), then 0 by standstill."""
    residual = np.array([[4.0], [8.0], [0.0], [0.0]])
    rests = np.array([False, False, False, True])
    found = compile_loop(predict_walk)(residual, np.full(4, 0.5), rests)
    assert found[:, 0].tolist() == [0.0, 2.0, 5.0, 0.0]


def test_whitened_walk_and_noise_are_white() -> None:
    """Variance 1 and no correlation: a walk of 0.3 per step in noise of 2, restarted at rests."""
    draw = np.random.default_rng(0)
    count = 20000
    rests = np.arange(count) % 1000 < 50
    walk = np.zeros(count)
    for k in range(1, count):
        walk[k] = 0.0 if rests[k] else walk[k - 1] + 0.3 * draw.standard_normal()
    residual = walk + 2.0 * draw.standard_normal(count)
    everywhere = np.ones(count, dtype=bool)
    white = whitener(2.0, 0.3, everywhere, rests, everywhere).whiten(residual[:, None])[:, 0]
    assert white.var() == pytest.approx(1.0, abs=0.03)
    assert np.mean(white[1:] * white[:-1]) == pytest.approx(0.0, abs=0.03)
