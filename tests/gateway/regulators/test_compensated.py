"""What the compensated regulator adds: standstill, breakaway, backlash, friction, lead, trim."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.configuration.config import Config
from gateway.friction.law import friction_torque
from gateway.physics.virtual_truck import truck_torque
from gateway.physics.window import Window
from gateway.regulators import compensated

CONFIG = Config().with_values({"regulator.trim": "0.8"})
PARAMS = compensated.Params.of(CONFIG)
INERTIA = 3640.0 * 0.645**2
ROAD = 0.645 * 0.011721 * 3640.0 * 9.81


def window(*, torque=0.0, motor=0.0, drum=0.0, change=0.0, temperature=None):
    return Window(
        duration=0.01,
        shaft_torque=torque,
        motor_speed=motor,
        drum_speed=drum,
        drum_speed_change=change,
        shell_temperature=temperature,
    )


def demands(windows, state=None, params=PARAMS):
    state = state or compensated.seed(params, 0.0, 0.0)
    for seen in windows:
        state, demand = compensated.update(params, state, seen)
        yield demand


def rolling_drum(torque, count):
    """Windows of a drum that a truck's torque turns freely inside the backlash, motor at rest."""
    change = torque / 312.71242 * 0.01
    return [window(drum=change * (k + 1), change=change) for k in range(count)]


def test_a_truck_in_the_backlash_is_seen_by_the_drum_alone():
    """It pushes with 100 N m over road load and margin: 0.01 rad/s earned after 0.152 s."""
    untrimmed = replace(PARAMS, trim=0.0)
    seen = list(demands(rolling_drum(ROAD + 30.0 + 100.0, 40), params=untrimmed))
    first = next(k for k, demand in enumerate(seen) if demand.speed > 0.0)
    assert first + 1 == np.ceil(0.01 * INERTIA / 100.0 / 0.01)


def test_below_the_road_load_and_its_margin_it_never_starts():
    assert all(one.speed == 0.0 for one in demands(rolling_drum(ROAD + 29.0, 500)))


def test_noise_of_the_sensors_does_not_start_it():
    """The noise of the practice logs: 0.01 rad/s at the drum, 0.15 at the motor, 0.25 N m."""
    random = np.random.default_rng(1)
    drum = 0.01 * random.standard_normal(6001)
    windows = [
        window(
            torque=float(0.25 * random.standard_normal()),
            motor=float(0.15 * random.standard_normal()),
            drum=float(drum[k + 1]),
            change=float(drum[k + 1] - drum[k]),
        )
        for k in range(6000)
    ]
    assert all(one.speed == 0.0 for one in demands(windows))


def test_it_stops_once_and_does_not_creep_on():
    state = compensated.seed(PARAMS, 20.0, 20.0 / 62.6)
    braked = [window(torque=-40.0, motor=5.0, drum=5.0 / 62.6)] * 100
    held = [window(torque=-40.0)] * 100
    seen = list(demands(braked + held, state))
    assert seen[0].speed > 0.0
    assert all(one.speed == 0.0 for one in seen[100:])


def test_friction_follows_the_motor_and_not_the_drum():
    seen = window(motor=200.0, drum=0.0)
    share = 1.0 - 0.003
    expected = share * friction_torque(200.0 / 62.6, PARAMS.friction)
    assert truck_torque(PARAMS, seen) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("gear_speed", "left_out"), [(0.01, 0.01966), (0.25, 0.0115), (0.5, 0.003), (6.0, 0.003)]
)
def test_friction_is_compensated_less_only_below_half_a_radian_per_second(gear_speed, left_out):
    seen = window(motor=62.6 * gear_speed)
    whole = friction_torque(gear_speed, PARAMS.friction)
    assert 1.0 - truck_torque(PARAMS, seen) / whole == pytest.approx(left_out, rel=1e-9)


def test_a_sticking_gear_explains_up_to_its_coulomb_friction():
    for torque, left in ((0.3, 0.0), (-0.3, 0.0), (1.0, 62.6 - 35.989), (-1.0, -62.6 + 35.989)):
        assert truck_torque(PARAMS, window(torque=torque)) == pytest.approx(left)


def test_friction_falls_with_the_temperature_of_the_shell():
    friction = replace(PARAMS.friction, temperature_coefficient=0.01)
    params = replace(PARAMS, friction=friction)
    warm = truck_torque(params, window(motor=200.0, temperature=273.15 + 42.0))
    nominal = truck_torque(PARAMS, window(motor=200.0))
    assert warm == pytest.approx(nominal * np.exp(-0.1))


def test_losses_by_load_and_in_the_bearings_are_part_of_the_friction():
    """626 N m drive the gear: what its friction leaves loses 1/11 by load; the bearings take 20.

    0.003 of the friction is left uncompensated.
    """
    nominal = PARAMS.friction
    friction = replace(
        nominal,
        load_dependent_gear_loss=replace(
            nominal.load_dependent_gear_loss, share=0.1, difference=0.0
        ),
        drum_bearing_friction=replace(nominal.drum_bearing_friction, coulomb=20.0, viscous=0.0),
    )
    gear = friction_torque(1.0, nominal)
    seen = truck_torque(
        replace(PARAMS, friction=friction), window(torque=-10.0, motor=62.6, drum=1.0)
    )
    assert seen == pytest.approx(-626.0 + 0.997 * (gear + (626.0 - gear) / 11.0 + 20.0))


def test_acceleration_of_the_drum_is_smoothed_over_50_ms():
    """The drum gains 2 rad/s^2 over 10 ms: 1 - exp(-0.2) of the way from 1 to 2."""
    state = replace(compensated.seed(PARAMS, 200.0, 3.0), drum_acceleration=1.0)
    after, _ = compensated.update(PARAMS, state, window(motor=200.0, drum=3.0, change=0.02))
    assert after.drum_acceleration == pytest.approx(1.0 + 0.181269)


def test_lead_adds_the_acceleration_times_its_time():
    state = compensated.seed(PARAMS, 200.0, 200.0 / 62.6)
    seen = window(torque=10.0, motor=200.0, drum=200.0 / 62.6)
    without = replace(PARAMS, lead=0.0)
    _, led = compensated.update(PARAMS, state, seen)
    _, plain = compensated.update(without, state, seen)
    acceleration = led.rate / (1.0 + PARAMS.trim)  # of the truck: the trim turns with it
    assert led.speed - plain.speed == pytest.approx(0.085 * acceleration)


def test_slope_of_a_demand_leads_to_the_next_demand_while_the_drum_falls_behind():
    """Inside the backlash the truck brakes the drum alone: 0.2 rad/s in 0.5 s."""
    drum, demands = 200.0 / 62.6, []
    state = compensated.seed(PARAMS, 200.0, drum)
    for _ in range(50):
        drum -= 0.004
        seen = replace(window(motor=200.0, drum=drum), drum_speed_change=-0.004)
        state, demand = compensated.update(PARAMS, state, seen)
        demands.append(demand)
    (before, now) = demands[-2:]
    assert now.speed - before.speed == pytest.approx(0.01 * before.rate, abs=0.002)


def test_lead_is_cut_back_for_a_light_truck():
    light = compensated.Params.of(CONFIG.with_values({"truck.mass_kg": "752"}))
    assert light.lead == pytest.approx(0.0425, rel=0.001)


def test_trim_adds_its_share_of_what_the_drum_is_behind_up_to_a_bound():
    state = compensated.seed(PARAMS, 200.0, 200.0 / 62.6)
    free = compensated.update(PARAMS, state, window(motor=200.0, drum=200.0 / 62.6))[1]
    behind = compensated.update(PARAMS, state, window(motor=200.0, drum=200.0 / 62.6 - 0.5))[1]
    far = compensated.update(PARAMS, state, window(motor=200.0, drum=200.0 / 62.6 - 2.0))[1]
    assert behind.speed - free.speed == pytest.approx(62.6 * 0.8 * 0.5)
    assert far.speed == pytest.approx(62.6 * 0.8, abs=free.speed)
    assert far.speed - behind.speed < 62.6 * 0.8 * 0.6


@pytest.mark.parametrize("drum", [3.0, 3.5])
def test_seeding_is_bumpless_also_while_the_drum_is_ahead_or_behind(drum):
    state = compensated.seed(PARAMS, 200.0, drum)
    trim = 0.8 * (state.virtual_speed - drum)
    assert 62.6 * (state.virtual_speed + trim) == pytest.approx(200.0)


@pytest.mark.parametrize(
    ("ahead", "trimmed"), [(2.0, 2.0 / 3.0), (-2.0, -2.0 / 3.0), (2.7, 0.8), (-2.7, -0.8)]
)
def test_seeding_is_bumpless_up_to_the_bound_of_the_trim_and_beyond(ahead, trimmed):
    """Gear ahead of the drum by 2: 0.5 x 2 / 1.5 is trimmed; by 2.7: 0.9, bounded to 0.8."""
    params = replace(PARAMS, trim=0.5)
    state = compensated.seed(params, 62.6 * 4.0, 4.0 - ahead)
    assert state.virtual_speed == pytest.approx(4.0 - trimmed)


def test_seeding_a_standing_bench_stands_however_the_drum_swings():
    state = compensated.seed(PARAMS, 0.0, -2.0)
    assert state == compensated.State(virtual_speed=0.0, moving=False)


DIRECT = replace(PARAMS, gear_ratio=1.0)
"""Motor and gear are one, so that a speed can lie exactly on an edge."""


@pytest.mark.parametrize(("speed", "moving"), [(0.01, False), (0.0101, True)])
def test_a_bench_that_turns_faster_than_a_start_is_seeded_as_moving(speed, moving):
    assert compensated.seed(DIRECT, speed, speed).moving is moving


@pytest.mark.parametrize(("speed", "sticks"), [(0.0049, True), (0.005, False), (-0.005, False)])
def test_a_gear_sticks_below_five_thousandths(speed, sticks):
    seen = truck_torque(DIRECT, window(torque=1.0, motor=speed))
    assert (seen == 0.0) is sticks


def test_a_share_left_out_at_standstill_counts_only_where_it_is_the_greater():
    params = replace(PARAMS, under_compensation=0.01, under_compensation_slow=0.003)
    whole = friction_torque(0.01, params.friction)
    seen = truck_torque(params, window(motor=0.626))
    assert 1.0 - seen / whole == pytest.approx(0.01)


def of_road(**newtons):
    """Parameters with that road load, without margin, lead or trim."""
    values = {"f0_N": "0", "f1_N_per_m_s": "0", "f2_N_per_m2_s2": "0"} | newtons
    changed = {f"truck.{key}": value for key, value in values.items()}
    changed |= {"regulator.breakaway_Nm": "0", "regulator.lead_s": "0", "regulator.trim": "0"}
    return compensated.Params.of(Config().with_values(changed))


@pytest.mark.parametrize(("speed", "force"), [(2.0, 481.141), (0.2, 406.61641), (0.0, 400.0)])
def test_the_road_slows_the_virtual_truck_by_its_speed(speed, force):
    """400 + 50 v + 10 v^2 with v = 0.645 x speed; the truck pushes with 1000 N m, motor at rest."""
    params = of_road(f0_N="400", f1_N_per_m_s="50", f2_N_per_m2_s2="10")
    state = compensated.State(virtual_speed=speed, moving=True)
    pushed = window(torque=(1000.0 + 35.989) / 62.6)
    after, demand = compensated.update(params, state, pushed)
    gained = (1000.0 - 0.645 * force) / INERTIA * 0.01
    assert after.virtual_speed - speed == pytest.approx(gained, rel=1e-6)
    assert demand.rate == pytest.approx(62.6 * gained / 0.01, rel=1e-6)


def test_a_truck_that_comes_to_rest_stands():
    state = compensated.State(virtual_speed=0.001, moving=True)
    after, demand = compensated.update(PARAMS, state, window(drum=0.1, change=-0.01))
    assert (after.virtual_speed, after.moving) == (0.0, False)
    assert (demand.speed, demand.rate) == (0.0, 0.0)


def test_what_holds_a_standing_truck_back_earns_no_debt():
    state = compensated.State(virtual_speed=0.0, moving=False)
    after, _ = compensated.update(PARAMS, state, window(torque=-40.0))
    assert after == state


def test_a_truck_without_speed_does_not_move():
    before = compensated.State(virtual_speed=0.0, moving=True)
    after, _ = compensated.update(of_road(), before, window())
    assert not after.moving


@pytest.mark.parametrize(("earned", "moving"), [(0.01, False), (0.0101, True)])
def test_a_start_has_to_be_earned_in_full(earned, moving):
    before = compensated.State(virtual_speed=earned, moving=False)
    after, _ = compensated.update(of_road(), before, window())
    assert after.moving is moving


def test_at_its_start_a_truck_has_the_speed_it_earned_and_no_lead_yet():
    before = compensated.State(virtual_speed=0.02, moving=False)
    params = replace(of_road(), lead=0.085)
    after, demand = compensated.update(params, before, window(torque=(100.0 + 35.989) / 62.6))
    assert after.virtual_speed == pytest.approx(0.02 + 100.0 / INERTIA * 0.01)
    assert demand.speed == pytest.approx(62.6 * after.virtual_speed)
    assert demand.rate == 0.0


def test_the_virtual_truck_goes_no_faster_than_the_bench():
    """4830 rpm = 505.796 rad/s of the motor = 8.0798 rad/s of the drum."""
    before = compensated.State(virtual_speed=8.07, moving=True)
    pushed = window(torque=200.0, motor=505.0, drum=8.07)
    after, demand = compensated.update(of_road(), before, pushed)
    assert after.virtual_speed == pytest.approx(8.0798, abs=1e-4)
    assert demand.speed == pytest.approx(505.796, abs=1e-3)


@pytest.mark.parametrize(
    ("drum", "speed", "slopes"), [(2.0, 0.0, 0.0), (0.01, 0.626, 1.8), (-20.0, 0.626, 1.0)]
)
def test_a_demand_has_its_slope_only_inside_the_range_of_the_bench(drum, speed, slopes):
    """Virtual truck at 0.01: a drum far ahead trims it to -1.59, bounded to 0, and takes 0.8.

    slopes : slope over that of the truck; the trim adds 0.8 of it until it is at its bound
    """
    params = replace(of_road(), trim=0.8)
    state = compensated.State(virtual_speed=0.01, moving=True)
    pushed = window(torque=(10.0 + 35.989) / 62.6, drum=drum)
    _, demand = compensated.update(params, state, pushed)
    trimmed = 62.6 * 0.8 if drum < 0.0 else 0.0
    assert demand.speed == pytest.approx(speed + trimmed, abs=0.01)
    assert demand.rate == pytest.approx(slopes * 62.6 * 10.0 / INERTIA)
    assert slopes or (demand.speed, demand.rate) == (0.0, 0.0)


def test_following_a_limit_stops_the_virtual_truck_at_standstill_and_not_before():
    state = compensated.State(virtual_speed=3.0, moving=True)
    params = of_road()
    assert compensated.follow(params, state, 62.6 * 3.0, 62.6 * 0.5).virtual_speed == (
        pytest.approx(0.5)
    )
    assert compensated.follow(params, state, 62.6 * 9.0, 0.0).virtual_speed == 0.0
