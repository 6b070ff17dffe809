"""What keeps from arming and what ends a run: each check at its edge, and which is named first."""

from dataclasses import replace
from math import inf

import pytest

from gateway.configuration.config import Config
from gateway.cycle.checks import check
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.signals import Alarm, Interlock, Measurement, Status

CONFIG = Config()
CLOSED = (
    Interlock.RESTRAINT
    | Interlock.GUARD
    | Interlock.FAN
    | Interlock.DOOR
    | Interlock.EMERGENCY_STOP
    | Interlock.DRIVE
)
GOOD = Measurement(
    sequence_start=7,
    sequence_end=7,
    plc_heartbeat=7,
    plc_time=1.0,
    status=Status.READY | Status.EMERGENCY_STOP_OK,
    interlock=CLOSED,
    alarm=Alarm(0),
    motor_speed=62.6 * 2.0,
    drum_speed=2.0,
    shaft_torque=-9.0,
)
BEFORE = (State.CONNECT, State.SHADOW, State.ARMED)


def found(
    measurement=GOOD,
    state=State.RUN,
    *,
    overruns=0,
    echo_age=0.0,
    other_age=inf,
    implausible=None,
):
    return check(
        CONFIG,
        measurement,
        state=state,
        overruns=overruns,
        echo_age=echo_age,
        other_age=other_age,
        implausible=implausible,
    )


def without(status):
    return replace(GOOD, status=GOOD.status & ~status)


@pytest.mark.parametrize("state", State)
def test_a_good_sample_holds_in_every_state(state):
    assert found(state=state) is None


@pytest.mark.parametrize("state", BEFORE)
def test_a_plc_that_is_not_ready_keeps_from_arming(state):
    assert found(without(Status.READY), state) is Reason.PLC_NOT_READY


def test_ready_is_not_asked_for_in_a_run():
    assert found(without(Status.READY)) is None


@pytest.mark.parametrize("state", State)
def test_either_sign_of_an_emergency_stop_is_one(state):
    closed = CLOSED & ~Interlock.EMERGENCY_STOP
    assert found(without(Status.EMERGENCY_STOP_OK), state) is Reason.EMERGENCY_STOP
    assert found(replace(GOOD, interlock=closed), state) is Reason.EMERGENCY_STOP


@pytest.mark.parametrize("interlock", set(Interlock) - {Interlock.EMERGENCY_STOP})
def test_each_interlock_that_is_open_is_told(interlock):
    assert found(replace(GOOD, interlock=CLOSED & ~interlock)) is Reason.INTERLOCK


def test_a_map_without_interlocks_leaves_the_emergency_stop_to_the_status():
    bare = replace(GOOD, interlock=None)
    assert found(bare) is None
    assert found(replace(bare, status=Status.READY)) is Reason.EMERGENCY_STOP


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_overspeed_is_5070_rpm_in_either_direction(sign):
    """5070 rpm = 530.93 rad/s of the motor."""
    at = replace(GOOD, motor_speed=sign * 530.92, drum_speed=sign * 530.92 / 62.6)
    over = replace(GOOD, motor_speed=sign * 530.94, drum_speed=sign * 530.94 / 62.6)
    assert (found(at), found(over)) == (None, Reason.OVERSPEED)


def test_overspeed_at_the_limit_is_none_yet():
    limit = CONFIG.limits.overspeed
    assert found(replace(GOOD, motor_speed=limit, drum_speed=limit / 62.6)) is None


@pytest.mark.parametrize("state", State)
def test_an_alarm_of_overspeed_and_a_fault_have_their_reasons(state):
    assert found(replace(GOOD, alarm=Alarm.OVERSPEED), state) is Reason.OVERSPEED
    faulty = replace(GOOD, status=GOOD.status | Status.FAULT)
    assert found(faulty, state) is Reason.PLC_FAULT


@pytest.mark.parametrize(
    "alarm", set(Alarm) - {Alarm.OVERSPEED, Alarm.COMMUNICATION, Alarm.SETPOINT_REJECTED}
)
@pytest.mark.parametrize("state", [State.SHADOW, State.RUN])
def test_every_other_alarm_counts_before_and_in_a_run(alarm, state):
    assert found(replace(GOOD, alarm=alarm), state) is Reason.PLC_ALARM


def test_the_alarm_of_our_silence_counts_in_a_run_only():
    silent = replace(GOOD, alarm=Alarm.COMMUNICATION)
    assert found(silent, State.SHADOW) is None
    assert found(silent, State.RUN) is Reason.PLC_ALARM


def test_another_alarm_is_not_hidden_by_that_of_our_silence():
    both = replace(GOOD, alarm=Alarm.COMMUNICATION | Alarm.DRIVE)
    assert found(both, State.SHADOW) is Reason.PLC_ALARM


def test_a_rejected_block_is_the_setpoint_in_a_run_and_the_map_before():
    rejected = replace(GOOD, alarm=Alarm.SETPOINT_REJECTED)
    assert found(rejected, State.RUN) is Reason.SETPOINT_REJECTED
    assert found(rejected, State.ARMED) is Reason.MAP_VERSION


def test_a_map_without_alarms_has_none():
    assert found(replace(GOOD, alarm=None)) is None


@pytest.mark.parametrize("ahead", [1.0, -1.0])
@pytest.mark.parametrize(
    ("state", "apart", "reason"),
    [
        (State.SHADOW, 0.49, None),
        (State.SHADOW, 0.51, Reason.IMPLAUSIBLE),
        (State.ARMED, 0.51, Reason.IMPLAUSIBLE),
        (State.RUN, 1.3, None),
        (State.RUN, 2.99, None),
        (State.RUN, 3.01, Reason.IMPLAUSIBLE),
    ],
)
def test_motor_and_drum_may_differ_by_half_before_and_by_3_in_a_run(state, apart, reason, ahead):
    assert found(replace(GOOD, drum_speed=2.0 + ahead * apart), state) is reason


@pytest.mark.parametrize(("state", "apart"), [(State.SHADOW, 0.5), (State.RUN, 3.0)])
def test_motor_and_drum_may_differ_by_exactly_the_limit(state, apart):
    standing = replace(GOOD, motor_speed=0.0, drum_speed=apart)
    assert found(standing, state) is None


def test_fifteen_deadlines_in_a_row_end_a_run():
    assert found(overruns=14) is None
    assert found(overruns=15) is Reason.OVERRUN


def test_commands_that_are_not_taken_over_for_100_ms_end_a_run():
    assert found(echo_age=0.1) is None
    assert found(echo_age=0.101) is Reason.NOT_ECHOED


@pytest.mark.parametrize("state", State)
def test_another_master_counts_in_every_state_for_a_second(state):
    assert found(state=state, other_age=0.0) is Reason.OTHER_MASTER
    assert found(state=state, other_age=1.0) is Reason.OTHER_MASTER
    assert found(state=state, other_age=1.01) is None


@pytest.mark.parametrize("state", BEFORE)
def test_deadlines_and_echo_keep_from_nothing_before_a_run(state):
    assert found(state=state, overruns=1000, echo_age=10.0) is None


@pytest.mark.parametrize("state", State)
def test_implausible_sensors_count_in_every_state(state):
    assert found(state=state, implausible=Reason.GEAR_MODEL) is Reason.GEAR_MODEL


def test_the_bench_is_named_before_its_alarm_and_that_before_the_speeds():
    worst = replace(GOOD, interlock=Interlock(0), alarm=Alarm.DRIVE, drum_speed=-9.0)
    assert found(worst) is Reason.EMERGENCY_STOP
    assert found(replace(worst, interlock=CLOSED)) is Reason.PLC_ALARM
    assert found(replace(worst, interlock=CLOSED, alarm=None)) is Reason.IMPLAUSIBLE
    assert found(replace(GOOD, drum_speed=-9.0), other_age=0.0) is Reason.IMPLAUSIBLE
    assert found(overruns=99, other_age=0.0) is Reason.OTHER_MASTER
    assert found(overruns=99, echo_age=9.0) is Reason.OVERRUN
