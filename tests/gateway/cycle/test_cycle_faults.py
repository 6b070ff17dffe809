"""The tick against the emulated PLC, in virtual time: every fault of a run."""

from dataclasses import replace

import pytest

from gateway.cycle import cycle
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps import load
from register_maps.codec import encode_setpoint
from register_maps.signals import Alarm, Interlock, Status
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop
from tests.gateway.cycle.disturbances import (
    CONFIG,
    alarmed,
    clock_at,
    clock_backwards,
    clock_stands,
    fault,
    frozen,
    left_run_after,
    no_echo,
    no_heartbeat,
    no_sequence,
    opened,
    other_echo,
    torn,
    torque_grows,
    without,
    without_echo,
)

DETECTED = 0.15
"""[s] The whole detection of a fault may take this long."""


LINK = [
    Reason.NOT_CONNECTED,
    Reason.CONNECTION_LOST,
    Reason.TIMEOUT,
    Reason.WRONG_TRANSACTION,
    Reason.WRONG_FUNCTION,
    Reason.WRONG_COUNT,
    Reason.NOT_FINITE,
    Reason.OUT_OF_RANGE,
    Reason.TEST_WORD,
    *[Reason(100 + code) for code in range(1, 12)],
]


FAULTS = [
    *[(fault(reason), reason) for reason in LINK],
    (frozen, Reason.HEARTBEAT_FROZEN),
    (no_heartbeat, Reason.HEARTBEAT_FROZEN),
    (no_sequence, Reason.SEQUENCE_FROZEN),
    (torn, Reason.TORN_IMAGE),
    (alarmed(Alarm.OVERSPEED), Reason.OVERSPEED),
    (alarmed(Alarm.COMMUNICATION), Reason.PLC_ALARM),
    (alarmed(Alarm.DRIVE), Reason.PLC_ALARM),
    (alarmed(Alarm.SETPOINT_REJECTED), Reason.SETPOINT_REJECTED),
    (without(Status.EMERGENCY_STOP_OK), Reason.EMERGENCY_STOP),
    (opened(Interlock.EMERGENCY_STOP), Reason.EMERGENCY_STOP),
    (opened(Interlock.DOOR), Reason.INTERLOCK),
    (without(Status.ENABLED), Reason.PLC_LEFT),
    (without(Status.ROAD_LOAD), Reason.PLC_LEFT),
    (lambda _, reading: replace(reading, status=reading.status | Status.FAULT), Reason.PLC_FAULT),
    (lambda _, reading: replace(reading, motor_speed=531.0), Reason.OVERSPEED),
    (lambda _, reading: replace(reading, drum_speed=-3.0), Reason.IMPLAUSIBLE),
    (no_echo, Reason.NOT_ECHOED),
    (clock_stands, Reason.PLC_CLOCK),
    (clock_backwards, Reason.PLC_RESTARTED),
    (torque_grows, Reason.TORQUE_IMPLAUSIBLE),
    (other_echo, Reason.OTHER_MASTER),
]


@pytest.mark.parametrize(
    ("disturb", "reason"), FAULTS, ids=lambda value: getattr(value, "name", "")
)
def test_each_fault_leaves_run_in_time_with_its_reason(running, disturb, reason):
    running.disturb = disturb
    assert left_run_after(running) <= DETECTED
    assert running.last.state is State.RAMPDOWN
    assert running.last.reason is reason
    running.run(3.0)
    assert (running.last.state, running.last.reason) == (State.SAFE, reason)
    running.disturb = lambda _, reading: reading
    running.run(1.5)
    assert running.last.state is State.SAFE
    for remote in (False, True, False, True):  # acknowledge, then start
        running.operate(remote=remote)
        running.run(1.2 if remote else 0.3)
    assert running.last.state is State.RUN


@pytest.mark.parametrize("factor", [0.1, 0.4, 2.0, 10.0])
def test_a_clock_that_is_far_too_fast_or_slow_ends_a_run(running, factor):
    running.disturb = clock_at(factor)
    left_run_after(running, within=2.5)
    assert running.last.reason in (Reason.PLC_CLOCK, Reason.TORQUE_IMPLAUSIBLE)


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_clock_that_is_a_little_off_ends_none(running, factor):
    running.disturb = clock_at(factor)
    running.run(3.0)
    assert running.last.state is State.RUN


@pytest.mark.parametrize(
    ("signal", "value", "samples"),
    [
        ("plc_time", 3600.0, 1000),
        ("shaft_torque_integral", 300.0, 1),
        ("shaft_torque_integral", 300.0, 1000),
    ],
)
def test_one_jump_of_clock_or_integral_is_left_out_and_moves_nothing(
    running, signal, value, samples
):
    """300 N m s over 10 ms would be 30 kN m; the truck of 3640 kg speeds up by a few rad/s^2."""
    begin, left = running.last.setpoint.speed_setpoint, samples

    def jumped(_, reading):
        nonlocal left
        left -= 1
        return replace(reading, **{signal: getattr(reading, signal) + value * (left >= 0)})

    running.disturb = jumped
    for number in range(1, 11):
        running.run(SCAN)
        moved = running.last.setpoint.speed_setpoint - begin
        assert -1.0 < moved < 100.0 * SCAN * number
    assert running.last.state is State.RUN


def test_of_two_gateways_that_begin_together_none_runs_unnoticed():
    """Both arm at once and write in turn: each sees the other's numbers."""
    first, second = ClosedLoop(CONFIG), cycle.initial(CONFIG, load("bench_int16"))
    numbers, states = set(), []
    for _ in range(30):
        first.run(SCAN)
        seen = replace(first.observations[-1], now=first.now + 0.002)
        second, output = cycle.step(CONFIG, first.map, second, seen)
        states.append((first.last.state, output.state))
        if output.setpoint is not None:
            numbers.add(output.setpoint.command_sequence)
            first.words = encode_setpoint(first.map, output.setpoint)
    own = {one.setpoint.command_sequence for one in first.outputs if one.setpoint}
    assert own
    assert numbers
    assert not own & numbers
    assert State.SHADOW in states[-1]
    assert (first.last.reason, output.reason).count(Reason.OTHER_MASTER) >= 1


@pytest.mark.parametrize("reason", [Reason.TIMEOUT, Reason.WRONG_COUNT, Reason.EXCEPTION_2])
def test_writes_that_fail_end_the_run_in_time_with_their_reason(reason):
    loop = without_echo()
    loop.refused = reason
    assert left_run_after(loop) <= DETECTED
    assert loop.last.reason is reason


def test_a_link_that_is_lost_at_a_write_ends_the_run_at_once(running):
    running.refused = Reason.CONNECTION_LOST
    assert left_run_after(running) <= 2 * SCAN
    assert running.last.reason is Reason.CONNECTION_LOST


def test_a_single_write_that_fails_is_borne(running):
    for _ in range(3):
        running.refused = Reason.TIMEOUT
        running.run(5 * SCAN)
        running.refused = None
        running.run(5 * SCAN)
    assert running.last.state is State.RUN


def test_a_write_and_readings_that_fail_in_turn_end_the_run_too(running):
    """Each second reading fails: what it hides of the write before it does not count as good."""
    running.refused = Reason.EXCEPTION_2
    running.disturb = lambda loop, reading: Reason.TIMEOUT if loop.plc.scans % 2 else reading
    assert left_run_after(running) <= DETECTED
    assert running.last.reason is Reason.EXCEPTION_2


def test_missed_deadlines_end_the_run(running):
    running.overruns = CONFIG.loop.overruns - 1
    running.run(SCAN)
    assert running.last.state is State.RUN
    running.overruns = CONFIG.loop.overruns
    running.run(SCAN)
    assert (running.last.state, running.last.reason) == (State.RAMPDOWN, Reason.OVERRUN)


def test_the_first_fault_of_a_series_is_the_reason(running):
    begin = running.now
    running.disturb = lambda loop, _: (
        Reason.TIMEOUT if loop.now < begin + 0.05 else Reason.NOT_CONNECTED
    )
    left_run_after(running)
    assert running.last.reason is Reason.TIMEOUT


def test_an_echo_that_no_reading_could_show_is_not_the_reason(running):
    """The last readings had the same echo: by the clock it has stood still for longer than they."""
    running.disturb = no_echo
    running.run(5 * SCAN)
    running.disturb = fault(Reason.EXCEPTION_6)
    left_run_after(running)
    assert running.last.reason is Reason.EXCEPTION_6


def test_recovery_needs_remote_off_and_on_to_acknowledge_and_again_to_start(running):
    running.disturb = fault(Reason.TIMEOUT)
    running.run(4.0)
    running.disturb = lambda _, reading: reading
    running.run(1.0)
    assert running.last.state is State.SAFE
    running.operate(remote=False)
    running.run(0.1)
    assert running.last.state is State.SAFE
    running.operate(remote=True)
    running.run(0.1)
    assert (running.last.state, running.last.reason) == (State.ARMED, None)
    running.operate(remote=False)
    running.run(0.1)
    running.operate(remote=True)
    running.run(0.3)
    assert running.last.state is State.RUN


def test_lost_polls_are_bridged_by_the_torque_integral():
    """Every third poll is lost: the run still ends where the same run without losses does."""

    def speed_after(disturb):
        loop = ClosedLoop(CONFIG, disturb=disturb)
        loop.start()
        loop.run(8.0)
        assert loop.last.state is State.RUN
        return loop.last.setpoint.speed_setpoint

    lossy = speed_after(
        lambda loop, reading: Reason.TIMEOUT if loop.plc.scans % 3 == 1 else reading
    )
    assert lossy == pytest.approx(speed_after(lambda _, reading: reading), rel=0.01)


def test_a_sample_shown_twice_is_neither_news_nor_a_fault(running):
    running.disturb = lambda loop, reading: (
        loop.observations[-1].measurement if loop.plc.scans % 2 else reading
    )
    running.run(2.0)
    assert running.last.state is State.RUN
