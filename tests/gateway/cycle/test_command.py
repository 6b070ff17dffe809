"""The command block: numbers, bits, echo, and what became of a write. Numbers by hand."""

from dataclasses import replace
from math import inf

import pytest

from gateway.configuration.config import Config, from_document
from gateway.cycle import command
from gateway.cycle.command import Command
from gateway.cycle.limits import Limit, Limited
from gateway.cycle.supervisor import State, Supervisor
from gateway.reasons import Reason
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
    assert (begin.sent, begin.other_wrote, begin.unanswered) == (-inf, -inf, 0)
    assert (begin.ticked, begin.heard, begin.asked, begin.arrived) == (-inf,) * 4
    assert (begin.down, begin.enabled) == (False, False)


def test_writing_begins_in_armed():
    assert {State.ARMED, State.RUN, State.RAMPDOWN, State.SAFE} == command.WRITING


IN_RUN = replace(READING, status=Status.ENABLED | Status.ROAD_LOAD)


def enable(state, seen, *, confirmed=True, before=True):
    supervisor = Supervisor(state=state, confirmed=confirmed)
    return command.stays_enabled(Config(), Command(enabled=before), supervisor, seen)


@pytest.mark.parametrize("state", [State.ARMED, State.SAFE])
def test_enable_is_off_outside_of_run_and_rampdown(state):
    assert not enable(state, IN_RUN)
    assert not enable(state, IN_RUN, confirmed=False)


@pytest.mark.parametrize("seen", [None, READING, IN_RUN])
def test_start_of_a_run_enables_until_the_plc_has_confirmed(seen):
    assert enable(State.RUN, seen, confirmed=False, before=False)


@pytest.mark.parametrize("state", [State.RUN, State.RAMPDOWN])
def test_enable_stays_only_while_this_tick_shows_the_plc_in_the_run(state):
    assert enable(state, IN_RUN)
    assert not enable(state, None)
    assert not enable(state, READING)


@pytest.mark.parametrize("state", [State.RUN, State.RAMPDOWN])
def test_enable_that_was_off_stays_off(state):
    assert not enable(state, IN_RUN, before=False)


@pytest.mark.parametrize(
    ("now", "number"),
    [(0.0, 42), (0.000001, 43), (0.03001, 42 + 30010), (0.030011, 42), (1.0, 42 + 9637)],
)
def test_the_first_number_is_of_the_moment_and_up_from_the_echo(now, number):
    """One up and the microseconds modulo 30011; so it is never the echo's."""
    seen = command.note_echo(MAP, Command(), READING, now)
    first = command.next_command(MAP, seen, PASSED, now, enable=False)
    assert first.number == number
    assert command.next_command(MAP, first, PASSED, now + 0.01, enable=False).number == number + 1


def test_without_an_echo_the_first_number_counts_from_one():
    assert command.next_command(MAP, Command(), PASSED, 0.0, enable=False).number == 1


def test_a_first_number_wraps_too():
    assert command.next_command(MAP, Command(echo=65530), PASSED, 0.00001, enable=False).number == 5


def test_number_zero_counts_as_one_that_was_written():
    assert (
        command.next_command(MAP, Command(number=0, echo=41), PASSED, 5.0, enable=False).number == 1
    )


def test_numbers_wrap_with_the_register_of_16_bits():
    numbers = [
        command.next_command(MAP, Command(number=n), PASSED, 5.0, enable=False).number
        for n in (65534, 65535)
    ]
    assert numbers == [65535, 0]


def test_a_map_without_the_number_does_not_wrap_it():
    kept = tuple(one for one in MAP.registers if one.signal != "command_sequence")
    bare = replace(MAP, registers=kept)
    assert (
        command.next_command(bare, Command(number=65535), PASSED, 5.0, enable=False).number == 65536
    )


def test_what_was_written_is_kept_with_its_time():
    after = command.next_command(MAP, Command(), PASSED, 5.0, enable=False)
    assert (after.speed, after.written, after.sent, after.unanswered) == (120.0, 5.0, 5.0, 1)
    stopped = command.reset(after, 6.0)
    assert (stopped.speed, stopped.written, stopped.sent) == (0.0, 6.0, 5.0)
    assert stopped.number == after.number


def test_the_echo_moves_when_it_changes():
    seen = command.note_echo(MAP, Command(), READING, 5.0)
    assert (seen.echo, seen.echo_moved) == (41, 5.0)
    assert command.note_echo(MAP, seen, READING, 6.0) == seen
    later = command.note_echo(MAP, seen, replace(READING, command_sequence_echo=42), 6.0)
    assert (later.echo, later.echo_moved) == (42, 6.0)


@pytest.mark.parametrize("reading", [None, replace(READING, command_sequence_echo=None)])
def test_no_echo_is_no_news(reading):
    assert command.note_echo(MAP, Command(), reading, 5.0) == Command()


def echo_of(number, *, written, last, unanswered, register_map=MAP):
    """What becomes of a command when the PLC echoes this number after another."""
    begin = Command(number=written, echo=last, unanswered=unanswered, sent=9.99)
    return command.note_echo(
        register_map, begin, replace(READING, command_sequence_echo=number), 10.0
    )


@pytest.mark.parametrize(
    ("number", "unanswered"), [(48, 2), (50, 0), (46, 4)], ids=["two left", "newest", "oldest"]
)
def test_an_echo_of_what_was_written_since_the_last_echo_is_ours(number, unanswered):
    after = echo_of(number, written=50, last=45, unanswered=5)
    assert (after.other_wrote, after.unanswered) == (-inf, unanswered)
    assert (after.echo, after.echo_moved) == (number, 10.0)


@pytest.mark.parametrize("number", [44, 51, 20000])
def test_an_echo_of_any_other_number_is_another_masters(number):
    after = echo_of(number, written=50, last=45, unanswered=5)
    assert (after.other_wrote, after.unanswered) == (10.0, 5)
    assert (after.echo, after.echo_moved) == (number, 10.0)


def test_our_numbers_are_ours_across_the_end_of_the_register():
    assert echo_of(65535, written=1, last=65533, unanswered=4).other_wrote == -inf
    assert echo_of(0, written=1, last=65533, unanswered=4).unanswered == 1
    assert echo_of(2, written=1, last=65533, unanswered=4).other_wrote == 10.0


def test_numbers_that_do_not_wrap_are_told_apart_as_well():
    kept = tuple(one for one in MAP.registers if one.signal != "command_sequence")
    bare = replace(MAP, registers=kept)
    assert echo_of(48, written=50, last=45, unanswered=5, register_map=bare).unanswered == 2
    assert echo_of(51, written=50, last=45, unanswered=5, register_map=bare).other_wrote == 10.0


def test_an_echo_that_moves_before_anything_was_written_is_another_masters():
    seen = command.note_echo(MAP, Command(), READING, 9.0)
    assert seen.other_wrote == -inf
    later = command.note_echo(MAP, seen, replace(READING, command_sequence_echo=42), 10.0)
    assert later.other_wrote == 10.0
    zero = command.note_echo(MAP, seen, replace(READING, command_sequence_echo=0), 10.0)
    assert zero.other_wrote == 10.0


@pytest.mark.parametrize(
    ("arrived", "age", "seen"),
    [
        (-inf, 0.0, True),
        (-inf, 0.24, True),
        (-inf, 0.25, False),
        (9.99, 0.0, False),
        (9.875, 0.0, True),
        (9.75, 0.125, True),
        (9.75, 0.2, False),
    ],
)
def test_a_command_younger_than_our_last_one_is_another_masters(arrived, age, seen):
    """Its age by the PLC, whose sample is of 10 s or later; 0.1 s may lie between."""
    reading = replace(READING, command_age=age)
    before = Command(echo=41, asked=10.0, arrived=arrived)
    after = command.note_echo(MAP, before, reading, 10.02)
    assert after.other_wrote == (10.02 if seen else -inf)


def test_a_command_exactly_as_late_as_may_be_is_ours():
    reading = replace(READING, command_age=0.0)
    before = Command(echo=41, asked=0.1, arrived=0.0)
    assert command.note_echo(MAP, before, reading, 0.12).other_wrote == -inf


def test_a_tick_that_took_long_read_earlier_and_wrote_later_than_its_time():
    """The tick of 5 s took 0.125 s: it may have begun at 4.875 s, or have ended at 5.125 s."""
    before = Command(ticked=5.0, heard=5.0, sent=5.0, asked=4.5, arrived=4.5)
    after = command.note_tick(before, 5.25, 0.125)
    assert (after.ticked, after.asked, after.arrived) == (5.25, 4.875, 5.125)


def test_a_tick_that_heard_and_wrote_nothing_tells_nothing():
    before = Command(ticked=5.0, heard=4.75, sent=4.75, asked=4.5, arrived=4.5)
    after = command.note_tick(before, 5.25, 0.125)
    assert (after.ticked, after.asked, after.arrived) == (5.25, 4.5, 4.5)


def test_a_block_whose_write_failed_may_have_arrived_until_the_next_good_reading():
    failed = replace(SENT, ticked=5.25, arrived=5.0)
    assert command.note_reply(failed, READING, Reason.TIMEOUT).arrived == 5.25
    assert command.note_reply(failed, READING, None).arrived == 5.0
    assert command.note_reply(failed, None, Reason.TIMEOUT).arrived == 5.0


def test_a_torn_image_says_nothing_of_the_time_of_a_sample():
    before = replace(SENT, ticked=5.25)
    assert command.note_reply(before, READING, None).heard == 5.25
    assert command.note_reply(before, replace(READING, sequence_end=8), None).heard == -inf


SENT = Command(number=3, written=5.0, got_through=4.99)


def test_a_good_reading_without_a_fault_says_that_the_write_got_through():
    failed = replace(SENT, fault=Reason.TIMEOUT, down=True)
    after = command.note_reply(failed, READING, None)
    assert (after.got_through, after.fault, after.down) == (5.0, None, False)


def test_a_fault_beside_a_good_reading_is_that_of_the_write():
    after = command.note_reply(SENT, READING, Reason.TIMEOUT)
    assert (after.got_through, after.fault, after.down) == (4.99, Reason.TIMEOUT, False)
    again = command.note_reply(after, READING, Reason.CONNECTION_LOST)
    assert (again.fault, again.down) == (Reason.TIMEOUT, True)
    assert not command.note_reply(again, READING, Reason.TIMEOUT).down


def test_a_state_that_writes_nothing_has_setpoint_zero_and_enable_off():
    after = command.reset(replace(SENT, speed=12.0, enabled=True), 6.0)
    assert (after.speed, after.written, after.enabled) == (0.0, 6.0, False)


@pytest.mark.parametrize("fault", [None, Reason.TIMEOUT])
def test_without_a_reading_nothing_is_known_of_the_write(fault):
    assert command.note_reply(SENT, None, fault) == SENT


def test_writes_are_complained_of_when_none_got_through_in_time():
    failed = command.note_reply(replace(SENT, got_through=5.0), READING, Reason.TIMEOUT)
    assert command.fault(failed, 5.125, 0.125) is None
    assert command.fault(failed, 5.126, 0.125) is Reason.TIMEOUT


@pytest.mark.parametrize(
    "fault", [Reason.CONNECTION_LOST, Reason.NOT_CONNECTED, Reason.NOT_ENCODABLE]
)
def test_what_no_waiting_cures_is_complained_of_at_once(fault):
    failed = command.note_reply(SENT, READING, fault)
    assert command.fault(failed, 5.0, 0.1) is fault


def test_without_a_fault_there_is_no_complaint_however_long_nothing_was_written():
    assert command.fault(Command(), 5.0, 0.1) is None


@pytest.mark.parametrize(
    ("enable", "control", "mode"),
    [(True, Control.ENABLE, Mode.ROAD_LOAD), (False, Control(0), Mode.READY)],
)
def test_the_block_holds_setpoint_limits_and_bits(enable, control, mode):
    """2000 and 3000 rpm/s: the steeper, 314.16 rad/s^2, bounds both ways."""
    config = Config().with_values({"limits.rate_up_rpm_s": "2000"})
    written = command.block(config, MAP, Command(number=9, enabled=enable), PASSED)
    assert (written.command_sequence, written.gateway_heartbeat) == (9, 9)
    assert (written.control, written.mode) == (control, mode)
    assert (written.speed_setpoint, written.speed_rate) == (120.0, 7.0)
    assert written.ramp_limit == pytest.approx(314.159265)
    assert (written.current_limit, written.watchdog_timeout) == (72.0, 0.2)
    assert written.map_version == MAP.version


SWEEP = from_document({"sweep": {"speeds_rpm": [1000.0], "hold_s": 5.0, "rate_rpm_s": 200.0}})


def test_a_sweep_of_steady_speeds_is_run_in_the_mode_of_speed():
    written = command.block(SWEEP, MAP, Command(enabled=True), PASSED)
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
    assert command.is_confirmed(config, status) is confirmed


def test_a_block_before_any_number_has_number_zero():
    written = command.block(Config(), MAP, Command(), PASSED)
    assert (written.command_sequence, written.gateway_heartbeat) == (0, 0)
