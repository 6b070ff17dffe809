"""What the learned regulator adds: it knows a reversal from earlier repeats and prepares for it."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from gateway.configuration.config import Config
from gateway.configuration.memory import NOTHING, Crossing, Memory, read_memory
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.offline.evaluation import agreement
from gateway.offline.learning import memory_after
from gateway.physics.window import Window
from gateway.regulators import compensated, learned
from plant_emulator.simulation.truck import Cycle, Forklift, ReplayedTorque, road_speed
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop

CONFIG = Config().with_values({"regulator.name": "learned"})
PARAMS = learned.Params.of(CONFIG)
TICK = 0.01
KNOWN = Crossing(time=10.0, direction=1.0, delay=0.05, best=0.02, cost=0.01, step=0.03)


def window(*, torque=0.0, motor=200.0, drum=200.0 / 62.6, change=0.0):
    return Window(
        duration=TICK,
        shaft_torque=torque,
        motor_speed=motor,
        drum_speed=drum,
        drum_speed_change=change,
    )


def rolling(crossing, time):
    """State of a rolling truck in a repeat that has a planned crossing."""
    memory = Memory(duration=30.0, crossings=(crossing,))
    repeat = learned.Repeat(time=time, side=1.0, torque=300.0, costs=(0.0,))
    return learned.State(virtual_speed=200.0 / 62.6, moving=True, memory=memory, repeat=repeat)


def test_without_a_memory_it_is_the_compensated_regulator():
    random = np.random.default_rng(3)
    state, other = learned.seed(PARAMS, 200.0, 3.2), compensated.seed(PARAMS, 200.0, 3.2)
    for torque in random.normal(-8.0, 3.0, 300):
        seen = window(torque=float(torque))
        state, demand = learned.update(PARAMS, state, seen)
        other, expected = compensated.update(PARAMS, other, seen)
        assert demand == expected


def ahead(crossing, since, until):
    """Speed of the gear relative to the truck in each tick of a repeat [rad/s], and its slope."""
    state, plain = rolling(crossing, since), rolling(crossing, since)
    plain = replace(plain, memory=replace(plain.memory, crossings=()), repeat=None)
    whole = replace(PARAMS, under_compensation=0.0, under_compensation_slow=0.0)
    rows = []
    for _ in range(round((until - since) / TICK)):
        state, with_it = learned.update(PARAMS, state, window())
        plain, without = learned.update(whole, plain, window())
        rows.append(((with_it.speed - without.speed) / 62.6, (with_it.rate - without.rate) / 62.6))
    return np.array(rows).T


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_planned_crossing_moves_the_gear_by_the_backlash_and_ends_at_the_speed_of_the_drum(
    direction,
):
    """Width 2 x 0.15073 rad; slope of the limits 3000 rpm/s = 314.159 rad/s^2 of the motor."""
    speed, slope = ahead(replace(KNOWN, direction=direction), 8.0, 12.0)
    assert TICK * speed.sum() == pytest.approx(direction * 2.0 * 0.15073, rel=1e-3)
    assert speed[0] == speed[-1] == 0.0
    assert np.abs(np.diff(speed)).max() <= TICK * 314.16 / 62.6
    assert np.abs(slope).max() == pytest.approx(314.159 / 62.6, rel=1e-4)


def test_a_planned_crossing_is_in_its_middle_a_lead_before_its_time_and_delay():
    speed, _ = ahead(KNOWN, 8.0, 12.0)
    assert 8.0 + TICK * (1 + np.argmax(speed)) == pytest.approx(10.05 - 0.085, abs=TICK)


def driven(torques, state):
    """State after a truck with these torques on the drum [N m], while the bench turns evenly."""
    share = {"under_compensation": 0.0, "under_compensation_slow": 0.0}
    params = replace(PARAMS, **share)
    friction = learned.truck_torque(params, window())
    for torque in torques:
        state, _ = learned.update(params, state, window(torque=(torque - friction) / 62.6))
    return state


def test_a_reversal_is_noted_with_its_time_and_direction():
    """The truck's torque falls from 1000 to -1500 N m at 2000 N m/s, from 1 s on.

    N = (1 - 0.2065) T + 0.2065 x 0.645 x 419 N passes zero at T = -70.3 N m: at 1.535 s.
    """
    begun = learned.State(virtual_speed=3.2, moving=True, repeat=learned.Repeat())
    time = TICK * np.arange(1, 260)
    torque = np.clip(1000.0 - 2000.0 * (time - 1.0), -1500.0, 1000.0)
    noise = np.random.default_rng(5).normal(0.0, 50.0, len(time))
    [(when, direction)] = driven(torque + noise, begun).repeat.found
    assert direction == 1.0
    assert when == pytest.approx(1.535, abs=0.03)


def test_a_torque_that_only_touches_zero_is_no_reversal():
    begun = learned.State(virtual_speed=3.2, moving=True, repeat=learned.Repeat())
    torque = np.concatenate(([500.0] * 100, [-150.0] * 100, [500.0] * 100))
    assert driven(torque, begun).repeat.found == ()


PLAIN = replace(
    PARAMS, gear_ratio=1.0, drum_inertia=0.0, under_compensation=1.0, under_compensation_slow=1.0
)
"""A bench that shows the truck's torque as it is, without gear, inertia and friction."""


def watched(last, torque=0.0, *, params=PLAIN, crossings=(), duration=TICK, drum=3.0):
    """The repeat after one more window; `last` : before it."""
    memory = Memory(crossings=crossings)
    state = learned.State(virtual_speed=3.2, moving=True, memory=memory, repeat=last)
    seen = Window(
        duration=duration,
        shaft_torque=torque,
        motor_speed=3.2,
        drum_speed=drum,
        drum_speed_change=0.0,
    )
    state, _ = learned.update(params, state, seen)
    return state


def test_torque_between_gear_and_drum_is_that_of_truck_and_road_by_their_inertias():
    """rho = 312.71242 / (3640 x 0.645^2); smoothed over 0.1 s, of which 10 ms pass."""
    rho = 312.71242 / (3640.0 * 0.645**2)
    params = replace(PLAIN, drum_inertia=PARAMS.drum_inertia)
    after = watched(learned.Repeat(torque=200.0), 50.0, params=params)
    road = 0.645 * params.road.force(0.645 * after.virtual_speed)
    between = (1.0 - rho) * 50.0 + rho * road
    assert after.repeat.torque == pytest.approx(between + (200.0 - between) * np.exp(-0.1))


@pytest.mark.parametrize(("torque", "side"), [(100.0, 0.0), (100.5, 1.0), (-100.5, -1.0)])
def test_a_flank_is_sure_above_100_newton_metres(torque, side):
    assert watched(learned.Repeat(torque=torque), torque).repeat.side == side


@pytest.mark.parametrize(
    ("before", "torque", "crossed"),
    [(0.0, 5.0, 3.0), (0.5, 0.5, 3.0), (-0.1, 5.0, 7.0 + TICK - 0.1)],
)
def test_torque_crosses_zero_where_its_sign_changes(before, torque, crossed):
    last = learned.Repeat(time=7.0, torque=before, crossed=3.0)
    assert watched(last, torque).repeat.crossed == pytest.approx(crossed)


@pytest.mark.parametrize(
    ("time", "counts"), [(9.375, False), (9.5, True), (10.875, True), (11.0, False)]
)
def test_error_of_the_drum_counts_from_600_ms_before_a_crossing_to_1_s_after(time, counts):
    last = learned.Repeat(time=time - 0.125, costs=(0.5,))
    after = watched(last, crossings=(KNOWN,), duration=0.125)
    error = 0.125 * (after.virtual_speed - 3.0) ** 2
    assert after.repeat.costs == pytest.approx((0.5 + error * counts,))


def test_the_time_600_ms_before_a_crossing_does_not_count_yet():
    last = learned.Repeat(time=-0.125, costs=(0.5,))
    after = watched(last, crossings=(replace(KNOWN, time=0.6),), duration=0.125)
    assert after.repeat.costs == (0.5,)


def test_a_repeat_belongs_to_the_crossings_of_its_memory():
    with pytest.raises(ValueError, match=r"longer|shorter"):
        watched(learned.Repeat(), crossings=(KNOWN,))
    with pytest.raises(ValueError, match=r"longer|shorter"):
        stopped((), ((10.0, 1.0),), Memory(duration=23.0, crossings=(KNOWN,)))


def test_a_repeat_begins_with_nothing_seen():
    memory = Memory(duration=30.0, crossings=(KNOWN,))
    standing = learned.State(virtual_speed=0.02, moving=False, memory=memory)
    begun, _ = learned.update(PLAIN, standing, window(torque=1000.0, motor=0.0, drum=0.0))
    assert begun.moving
    expected = learned.Repeat(time=0.0, torque=0.0, side=0.0, crossed=0.0, costs=(0.0,))
    assert begun.repeat == expected


def test_the_gear_is_accelerated_at_the_lesser_slope_of_the_limits():
    """100 rpm/s = 10.472 rad/s^2 of the motor."""
    slow = {"limits.rate_down_rpm_s": "100"}
    found = learned.Params.of(CONFIG.with_values(slow))
    assert found.approach == pytest.approx(10.472 / 62.6, rel=1e-4)


def test_a_planned_crossing_has_ended_where_its_half_time_is_over():
    """Width 1 rad at 4 rad/s^2: 0.5 s from the middle at 10 s to the end."""
    params = replace(PLAIN, backlash=1.0, approach=4.0, preview=0.0, trim=0.0, lead=0.0)
    one = replace(KNOWN, delay=0.0)
    rates = []
    for crossings in ((one,), ()):
        memory = Memory(crossings=crossings)
        last = learned.Repeat(time=10.375, costs=(0.0,) * len(crossings))
        state = learned.State(virtual_speed=3.2, moving=True, memory=memory, repeat=last)
        seen = replace(window(motor=3.2, drum=3.2), duration=0.125)
        rates.append(learned.update(params, state, seen)[1].rate)
    assert rates[0] == rates[1]


def stopped(costs, found, memory):
    """State after a repeat that showed these costs and reversals."""
    repeat = learned.Repeat(time=24.0, costs=costs, found=found)
    state = learned.State(virtual_speed=0.0001, moving=True, memory=memory, repeat=repeat)
    state, demand = learned.update(PARAMS, state, window(torque=-40.0, motor=0.0, drum=0.0))
    assert (demand.speed, state.moving, state.repeat) == (0.0, False, None)
    return state.memory


@pytest.mark.parametrize(
    ("cost", "delay", "best", "step"),
    [(0.005, 0.08, 0.05, 0.03), (0.01, 0.08, 0.05, 0.03), (0.02, 0.005, 0.02, -0.015)],
)
def test_a_step_that_helped_is_repeated_and_another_taken_back_by_half(cost, delay, best, step):
    memory = Memory(duration=23.0, crossings=(KNOWN,))
    [after] = stopped((cost,), ((10.1, 1.0),), memory).crossings
    assert (after.time, after.delay, after.best, after.step) == pytest.approx(
        (10.1, delay, best, step)
    )
    assert after.cost == min(cost, 0.01)


def test_a_new_reversal_is_remembered_and_one_that_did_not_come_is_forgotten():
    memory = Memory(duration=23.0, crossings=(KNOWN,))
    after = stopped((0.01,), ((14.0, 1.0), (10.0, -1.0)), memory)
    assert after.duration == 24.0
    assert [(one.time, one.direction, one.cost) for one in after.crossings] == [
        (14.0, 1.0, 0.0),
        (10.0, -1.0, 0.0),
    ]


def test_a_reversal_half_a_second_from_a_known_one_is_another():
    memory = Memory(duration=23.0, crossings=(KNOWN,))
    [after] = stopped((0.01,), ((10.5, 1.0),), memory).crossings
    assert (after.delay, after.best, after.cost, after.step) == (0.04, 0.04, 0.0, 0.03)


def test_the_whole_friction_is_compensated_only_while_a_known_cycle_lasts():
    speeds = []
    for time in (5.0, 29.985, 30.0, 40.0):
        state = rolling(replace(KNOWN, time=99.0), time)
        after, _ = learned.update(PARAMS, state, window())
        speeds.append(after.virtual_speed)
    assert speeds[0] == speeds[1] > speeds[2] == speeds[3]


def test_a_run_that_begins_with_a_rolling_truck_learns_nothing_before_the_next_start():
    state = driven([500.0] * 50 + [-2000.0] * 400, learned.seed(PARAMS, 200.0, 3.2))
    assert not state.moving
    assert state.memory == NOTHING


def drive(loop, duration):
    loop.start()
    loop.drum_speed.clear()
    loop.wheel_torque.clear()
    loop.run(duration)
    assert loop.last.state is State.RUN
    torque = np.append(0.0, loop.wheel_torque)
    road = road_speed(Forklift(), SCAN * np.arange(len(torque)), torque)[1:]
    return agreement(road, 0.645 * np.array(loop.drum_speed)), road


def peak(loop):
    """Largest shaft torque when the gear meets the drum again while the truck brakes [N m]."""
    return max(-one.measurement.shaft_torque for one in loop.observations)


def knowing(memory):
    # the truck of the emulator rolls with 0.0117
    return CONFIG.with_values({"regulator.learned": memory.document, "truck.crr": 0.0117})


@pytest.fixture(scope="module")
def first():
    """The first time that the regulator sees the cycle."""
    loop = ClosedLoop(knowing(NOTHING))
    return loop, drive(loop, 30.0)[0]


@pytest.mark.slow
def test_a_repeated_cycle_comes_nearer_to_the_road_and_its_flanks_meet_more_gently(first):
    before, agreed = first
    assert (agreed.val1, agreed.val2) == pytest.approx((98.7, 99.3), abs=0.1)
    after = ClosedLoop(knowing(before.state.regulator.memory))
    close, _ = drive(after, 30.0)
    assert close.val1 >= 99.2
    assert close.val2 >= 99.7
    assert peak(after) < 0.6 * peak(before)


@pytest.mark.slow
def test_a_recording_of_the_run_tells_the_memory_that_it_left(first):
    loop, _ = first
    memory = loop.state.regulator.memory
    assert memory_after(loop.config, loop.map, loop.observations) == memory
    assert memory != NOTHING
    assert read_memory(tomllib.loads(memory.toml), "") == memory
    other = loop.config.with_values({"regulator.name": "compensated"})
    with pytest.raises(ConfigError, match=r"regulator\.name.*'compensated'; expected learned"):
        memory_after(other, loop.map, loop.observations)


@pytest.mark.slow
def test_a_driver_who_does_not_brake_as_before_feels_no_more_than_the_backlash(first):
    """Free through 0.3 rad, 270 N m of the truck speed up 312.7 kg m^2 by 0.73 rad/s at most."""
    later = ClosedLoop(
        knowing(first[0].state.regulator.memory),
        driver=lambda truck: ReplayedTorque(truck, Cycle(brake=26.0)),
    )
    _, road = drive(later, 25.0)
    error = np.array(later.drum_speed) - road / 0.645
    assert np.abs(error[1500:]).max() < 0.73
    assert abs(error[-1]) < 0.05
