"""The command block: numbers, bits, echo, and what became of a write. Numbers by hand."""

from dataclasses import replace
from math import inf

import pytest

from gateway import command
from gateway.command import Command
from gateway.config import Config, from_document
from gateway.limits import Limit, Limited
from gateway.reasons import Reason
from gateway.supervisor import State
from register_maps import load
from register_maps.signals import Control, Measurement, Mode, Status

MAP = load("bench_int16")
PASSED = Limited(speed=120.0, rate=7.0, by=Limit.NONE)
READING = Measurement(
    sequence_start=7,
    sequence_end=7,
    plc_heartbeat=7,
    plc_time=1.0,
    status=Status.READY,
    motor_speed=100.0,
    drum_speed=1.6,
    shaft_torque=-9.0,
    command_sequence_echo=41,
)


def test_before_the_first_tick_nothing_is_written_nor_known():
    begin = Command()
    assert (begin.number, begin.echo, begin.fault) == (None, None, None)
    assert (begin.speed, begin.written) == (0.0, 0.0)
    assert (begin.echo_moved, begin.got_through) == (-inf, -inf)
    assert not begin.down


def test_writing_begins_in_armed_and_enables_from_run_to_the_end_of_the_rampdown():
    assert {State.ARMED, State.RUN, State.RAMPDOWN, State.SAFE} == command.WRITING
    assert {State.RUN, State.RAMPDOWN} == command.ENABLING


def test_the_first_number_is_one_up_from_the_echo_and_the_next_from_the_last():
    seen = command.echoed(Command(), READING, 5.0)
    first = command.following(MAP, seen, PASSED, 5.0)
    assert first.number == 42
    assert command.following(MAP, first, PASSED, 5.01).number == 43


def test_without_an_echo_the_first_number_is_one():
    assert command.following(MAP, Command(), PASSED, 5.0).number == 1


def test_number_zero_counts_as_one_that_was_written():
    assert command.following(MAP, Command(number=0, echo=41), PASSED, 5.0).number == 1


def test_numbers_wrap_with_the_register_of_16_bits():
    numbers = [
        command.following(MAP, Command(number=n), PASSED, 5.0).number for n in (65534, 65535)
    ]
    assert numbers == [65535, 0]


def test_a_map_without_the_number_does_not_wrap_it():
    kept = tuple(one for one in MAP.registers if one.signal != "command_sequence")
    bare = replace(MAP, registers=kept)
    assert command.following(bare, Command(number=65535), PASSED, 5.0).number == 65536


def test_what_was_written_is_kept_with_its_time():
    after = command.following(MAP, Command(), PASSED, 5.0)
    assert (after.speed, after.written) == (120.0, 5.0)
    stopped = command.nothing(after, 6.0)
    assert (stopped.speed, stopped.written, stopped.number) == (0.0, 6.0, 1)


def test_the_echo_moves_when_it_changes():
    seen = command.echoed(Command(), READING, 5.0)
    assert (seen.echo, seen.echo_moved) == (41, 5.0)
    assert command.echoed(seen, READING, 6.0) == seen
    later = command.echoed(seen, replace(READING, command_sequence_echo=42), 6.0)
    assert (later.echo, later.echo_moved) == (42, 6.0)


@pytest.mark.parametrize("reading", [None, replace(READING, command_sequence_echo=None)])
def test_no_echo_is_no_news(reading):
    assert command.echoed(Command(), reading, 5.0) == Command()


SENT = Command(number=3, written=5.0, got_through=4.99)


def test_a_good_reading_without_a_fault_says_that_the_write_got_through():
    failed = replace(SENT, fault=Reason.TIMEOUT, down=True)
    after = command.answered(failed, READING, None)
    assert (after.got_through, after.fault, after.down) == (5.0, None, False)


def test_a_fault_beside_a_good_reading_is_that_of_the_write():
    after = command.answered(SENT, READING, Reason.TIMEOUT)
    assert (after.got_through, after.fault, after.down) == (4.99, Reason.TIMEOUT, False)
    again = command.answered(after, READING, Reason.CONNECTION_LOST)
    assert (again.fault, again.down) == (Reason.TIMEOUT, True)
    assert not command.answered(again, READING, Reason.TIMEOUT).down


@pytest.mark.parametrize("fault", [None, Reason.TIMEOUT])
def test_without_a_reading_nothing_is_known_of_the_write(fault):
    assert command.answered(SENT, None, fault) == SENT


def test_writes_are_complained_of_when_none_got_through_in_time():
    failed = command.answered(replace(SENT, got_through=5.0), READING, Reason.TIMEOUT)
    assert command.complaint(failed, 5.125, 0.125) is None
    assert command.complaint(failed, 5.126, 0.125) is Reason.TIMEOUT


def test_a_lost_link_is_complained_of_at_once():
    failed = command.answered(SENT, READING, Reason.CONNECTION_LOST)
    assert command.complaint(failed, 5.0, 0.1) is Reason.CONNECTION_LOST


def test_without_a_fault_there_is_no_complaint_however_long_nothing_was_written():
    assert command.complaint(Command(), 5.0, 0.1) is None


@pytest.mark.parametrize(
    ("enable", "control", "mode"),
    [(True, Control.ENABLE, Mode.ROAD_LOAD), (False, Control(0), Mode.READY)],
)
def test_the_block_holds_setpoint_limits_and_bits(enable, control, mode):
    """2000 and 3000 rpm/s: the steeper, 314.16 rad/s^2, bounds both ways."""
    config = Config().with_values({"limits.rate_up_rpm_s": "2000"})
    written = command.block(config, MAP, Command(number=9), PASSED, enable=enable)
    assert (written.command_sequence, written.gateway_heartbeat) == (9, 9)
    assert (written.control, written.mode) == (control, mode)
    assert (written.speed_setpoint, written.speed_rate) == (120.0, 7.0)
    assert written.ramp_limit == pytest.approx(314.159265)
    assert (written.current_limit, written.watchdog_timeout) == (72.0, 0.2)
    assert written.map_version == MAP.version


SWEEP = from_document({"sweep": {"speeds_rpm": [1000.0], "hold_s": 5.0, "rate_rpm_s": 200.0}})


def test_a_sweep_of_steady_speeds_is_run_in_the_mode_of_speed():
    written = command.block(SWEEP, MAP, Command(), PASSED, enable=True)
    assert (written.control, written.mode) == (Control.ENABLE, Mode.SPEED)


@pytest.mark.parametrize(
    ("config", "status", "confirmed"),
    [
        (Config(), Status.ENABLED | Status.ROAD_LOAD, True),
        (Config(), Status.ENABLED, False),
        (Config(), Status.ROAD_LOAD, False),
        (SWEEP, Status.ENABLED, True),
        (SWEEP, Status.ENABLED | Status.ROAD_LOAD, False),
        (SWEEP, Status(0), False),
    ],
)
def test_confirmed_is_what_is_enabled_in_the_mode_of_the_run(config, status, confirmed):
    assert command.confirmed(config, status) is confirmed


def test_a_block_before_any_number_has_number_zero():
    written = command.block(Config(), MAP, Command(), PASSED, enable=False)
    assert (written.command_sequence, written.gateway_heartbeat) == (0, 0)
