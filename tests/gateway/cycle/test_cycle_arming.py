"""The tick against the emulated PLC, in virtual time: faults that keep a run from its start."""

import pytest

from gateway.cycle import cycle
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.signals import Alarm, Status
from register_maps.timing import SCAN
from tests.gateway.cycle.disturbances import (
    CONFIG,
    alarmed,
    clock_backwards,
    clock_stands,
    other_echo,
    torque_grows,
    without,
)


@pytest.mark.parametrize(
    ("disturb", "reason"),
    [
        (clock_stands, Reason.PLC_CLOCK),
        (clock_backwards, Reason.PLC_RESTARTED),
        (torque_grows, Reason.TORQUE_IMPLAUSIBLE),
    ],
)
def test_nothing_is_armed_without_a_window_that_can_be_used(idle, disturb, reason):
    idle.disturb = disturb
    idle.run(0.5)
    assert {output.state for output in idle.outputs} == {State.CONNECT}
    assert idle.last.reason is reason


def test_a_clock_that_stops_in_armed_takes_the_readiness_away(idle):
    idle.run(0.2)
    idle.disturb = clock_stands
    idle.run(0.2)
    idle.operate(remote=True)
    idle.run(0.2)
    assert (idle.last.state, idle.last.reason) == (State.CONNECT, Reason.PLC_CLOCK)


def test_another_master_takes_the_readiness_away(idle):
    idle.run(0.2)
    idle.disturb = other_echo
    idle.run(4 * SCAN)
    assert (idle.last.state, idle.last.reason) == (State.SHADOW, Reason.OTHER_MASTER)


def test_a_second_gateway_does_not_arm_while_the_first_one_runs(running):
    second, seen = cycle.initial(CONFIG, running.map), set()
    for _ in range(200):
        running.run(SCAN)
        second, output = cycle.step(CONFIG, running.map, second, running.observations[-1])
        seen.add(output.state)
        assert output.setpoint is None
    assert seen == {State.CONNECT, State.SHADOW}
    assert output.reason is Reason.OTHER_MASTER
    assert running.last.state is State.RUN


def test_no_run_starts_while_writes_fail(idle):
    idle.run(0.2)
    idle.refused = Reason.EXCEPTION_2
    idle.run(0.2)
    idle.operate(remote=True)
    idle.run(0.2)
    assert (idle.last.state, idle.last.reason) == (State.ARMED, Reason.EXCEPTION_2)


@pytest.mark.parametrize("alarm", [Alarm.DRIVE, Alarm.OVERSPEED, Alarm.SETPOINT_REJECTED])
def test_an_alarm_keeps_from_arming(idle, alarm):
    idle.disturb = alarmed(alarm)
    idle.run(0.2)
    assert idle.last.state is State.SHADOW


def test_the_alarm_that_our_own_silence_caused_does_not_keep_from_arming(idle):
    idle.disturb = alarmed(Alarm.COMMUNICATION)
    idle.run(0.2)
    assert idle.last.state is State.ARMED


def test_a_plc_that_refuses_the_map_version_is_named_so(idle):
    idle.run(0.2)
    idle.disturb = alarmed(Alarm.SETPOINT_REJECTED)
    idle.run(SCAN)
    assert (idle.last.state, idle.last.reason) == (State.SHADOW, Reason.MAP_VERSION)


def test_a_plc_that_is_not_ready_is_waited_for(idle):
    idle.disturb = without(Status.READY)
    idle.run(0.2)
    assert (idle.last.state, idle.last.reason) == (State.SHADOW, Reason.PLC_NOT_READY)
