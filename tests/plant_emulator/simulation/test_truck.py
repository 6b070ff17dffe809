"""The forklift: road load, cycle, drivers, and the road as the target."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.configuration.sections import BenchConfig, TruckConfig
from plant_emulator.parameter_sets import load
from plant_emulator.signals.log import Log
from plant_emulator.simulation.fit_metrics import fit
from plant_emulator.simulation.programs import sample_times
from plant_emulator.simulation.truck import (
    Cycle,
    Forklift,
    PiDriver,
    ReplayedTorque,
    drive_on_road,
    driver_of,
    road_speed,
    road_step,
)

ReadLog = Callable[[str], Log]
TOP_SPEED = 14 / 3.6
EMPTY, LOADED = Forklift(mass=3640.0), Forklift(mass=5240.0)


def test_radii_are_those_of_table_3_1_and_of_the_daemon() -> None:
    shipped, bench, road = load(), BenchConfig(), TruckConfig()
    assert shipped.value("drum_radius") == bench.drum_radius == EMPTY.drum_radius == 0.645
    assert shipped.value("wheel_radius") == road.wheel_radius == EMPTY.wheel_radius == 0.1715


# --- road load --------------------------------------------------------------------------------


def test_road_load_of_the_empty_truck_at_14_km_per_hour_is_419_newton() -> None:
    """Thesis, Table 4.1, without load: C_rr 0.011721, C_rr,v 9.3882e-6 on the drum's speed."""
    thesis = Forklift(mass=3640.0, crr=0.011721, crr_v=9.3882e-6)
    by_hand = 3640.0 * 9.81 * (0.011721 + 9.3882e-6 * TOP_SPEED / 0.645)
    assert by_hand == pytest.approx(420.6, abs=0.1)
    assert thesis.road_load(TOP_SPEED) == pytest.approx(by_hand)
    assert EMPTY.road_load(TOP_SPEED) == pytest.approx(by_hand, rel=5e-3)


def test_road_load_is_against_the_motion_and_nothing_at_rest() -> None:
    assert EMPTY.road_load(-2.0) == -EMPTY.road_load(2.0) < 0.0
    assert EMPTY.road_load(0.0) == 0.0


# --- cycle ------------------------------------------------------------------------------------


@given(time=st.floats(0.0, 30.0))
def test_velocity_is_the_integral_of_the_acceleration(time: float) -> None:
    cycle, h = Cycle(), 1e-3
    gained = cycle.velocity(time + h) - cycle.velocity(time - h)
    assert gained / (2 * h) == pytest.approx(cycle.acceleration(time), abs=2e-3)


def test_cycle_stands_reaches_14_km_per_hour_and_stands_again() -> None:
    cycle = Cycle()
    assert cycle.velocity(2.0) == 0.0
    assert cycle.velocity(15.0) == pytest.approx(TOP_SPEED)
    assert cycle.velocity(29.0) == pytest.approx(0.0, abs=1e-12)
    assert cycle.acceleration(15.0) == 0.0


# --- drivers ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("truck", "program"), [(EMPTY, "program6"), (LOADED, "program6L")], ids=["empty", "loaded"]
)
def test_replayed_torque_is_the_independent_benchs_until_the_parking_brake(
    truck: Forklift, program: str, bench_log: ReadLog
) -> None:
    log = bench_log(f"bench_nominal/{program}")
    driver = ReplayedTorque(truck)
    rolling = slice(1, 2550)
    torque = [driver.torques(float(t), 0.0)[0] for t in log.time[:-1]]
    span = np.ptp(log["wheel_torque"])
    logged = log["wheel_torque"][1:]
    assert np.abs(torque - logged)[rolling].max() <= 1e-3 * span


def test_replayed_torque_does_not_look_at_the_bench() -> None:
    driver = ReplayedTorque(EMPTY)
    assert driver.torques(5.0, 0.0) == driver.torques(5.0, 3.0)


@pytest.mark.parametrize("name", ["none", "pi"])
def test_truck_is_parked_before_the_start_and_after_the_stop(name: str) -> None:
    driver = driver_of(name, EMPTY)
    for time in (0.0, 2.0, 29.0):
        drive, brake = driver.torques(time, 0.0)
        assert drive == 0.0
        assert brake > 100.0


@pytest.mark.parametrize("truck", [EMPTY, LOADED], ids=["empty", "loaded"])
def test_pi_driver_needs_the_road_load_to_cruise_on_the_road(truck: Forklift) -> None:
    time = sample_times(30.0)
    speed, torque = drive_on_road(PiDriver(truck), truck, time)
    cruise = (time > 15.0) & (time < 21.9)
    assert speed[cruise] == pytest.approx(TOP_SPEED, rel=2e-3)
    force = torque[cruise].mean() / truck.wheel_radius
    assert force == pytest.approx(truck.mass * 9.81 * 0.0117, rel=1e-2)
    assert speed[-1] == 0.0


def test_pi_drivers_integral_waits_while_its_torque_is_limited() -> None:
    driver = PiDriver(EMPTY, torque_limit=100.0)
    for k in range(300):
        assert driver.torques(5.0 + 0.01 * k, 0.0)[0] == 100.0
    assert driver.torques(8.0, TOP_SPEED + 0.5)[0] == -100.0


# --- the road ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("truck", "program"), [(EMPTY, "program6"), (LOADED, "program6L")], ids=["empty", "loaded"]
)
def test_logged_wheel_torque_takes_the_truck_to_14_km_per_hour_and_back_to_rest(
    truck: Forklift, program: str, bench_log: ReadLog
) -> None:
    log = bench_log(f"bench_nominal/{program}")
    speed = road_speed(truck, log.time, log["wheel_torque"])
    assert speed[log.time < 2.0].max() == 0.0
    assert speed[1500] == pytest.approx(TOP_SPEED, rel=2e-3)
    assert speed.max() == pytest.approx(TOP_SPEED, rel=5e-3)
    assert speed[-1] == 0.0


@pytest.mark.parametrize(
    ("truck", "program"), [(EMPTY, "program6"), (LOADED, "program6L")], ids=["empty", "loaded"]
)
def test_independent_bench_follows_that_road_as_well_as_the_issue_asks(
    truck: Forklift, program: str, bench_log: ReadLog
) -> None:
    """The thesis's regulator reached 98.2/98.3 and 98.3/98.9 in the design study."""
    log = bench_log(f"bench_nominal/{program}")
    road = road_speed(truck, log.time, log["wheel_torque"])
    bench = 0.645 * log["drum_speed"]
    velocity = fit(road, bench)
    assert velocity.val1 >= 98.0
    assert velocity.val2 >= 98.0


def test_constant_torque_accelerates_by_newton() -> None:
    """(T / r_w - F_RL) / m = (171.5 / 0.1715 - 417.8) / 3640."""
    time = sample_times(1.0)
    speed = road_speed(EMPTY, time, np.full(101, 171.5))
    assert speed[-1] == pytest.approx((1000.0 - 3640 * 9.81 * 0.0117) / 3640, rel=1e-3)


def test_rolling_truck_coasts_to_rest_and_stays() -> None:
    speed = 0.05
    for _ in range(100):
        speed = road_step(EMPTY, speed, 0.0, 0.0, 0.01)
    assert speed == 0.0


@given(speed=st.floats(-4.0, 4.0), brake=st.floats(0.0, 2000.0), period=st.floats(1e-3, 0.2))
def test_brake_never_turns_the_truck_round(speed: float, brake: float, period: float) -> None:
    after = road_step(EMPTY, speed, 0.0, brake, period)
    assert abs(after) <= abs(speed)
    assert after * speed >= 0.0


@given(torque=st.floats(-400.0, 400.0))
def test_standing_truck_is_held_while_drive_is_below_brake_and_rolling_resistance(
    torque: float,
) -> None:
    held = abs(torque) <= 300.0 + EMPTY.road_load(1e-9) * 0.1715
    assert (road_step(EMPTY, 0.0, torque, 300.0, 0.01) == 0.0) == held
