"""The emulated PLC around a bench whose motor follows its reference exactly."""

import itertools
from dataclasses import dataclass, field, replace
from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_emulator.emulator.plc.plc import Plc
from plant_emulator.emulator.plc.state import TRANSITIONS, Event
from plant_emulator.emulator.plc.surroundings import CLOSED, Switches, Truck
from register_maps import load
from register_maps.codec import decode_measurement, encode_measurement, encode_setpoint
from register_maps.signals import (
    Alarm,
    Control,
    Interlock,
    Measurement,
    Mode,
    PlcState,
    Setpoint,
    Status,
)
from tests.plant_emulator.solver.linear_bench import BACKLASH, LinearBench

RPM = 2 * pi / 60
INT16 = load("bench_int16")
FLOAT32 = load("bench_float32")
# Words of the int16 command block in the map; CMD_SEQ is word 0.
HB, CTRL, MODE, SPEED_REF, SPEED_RATE, RAMP, CURRENT, WATCHDOG, VERSION = range(1, 10)


@dataclass
class Desk:
    """A PLC, the operator's switches and a gateway that numbers its commands."""

    plc: Plc
    switches: Switches = field(default_factory=lambda: Switches(remote=True))
    words: tuple[int, ...] | None = None
    setpoint: Setpoint = field(
        default_factory=lambda: Setpoint(
            command_sequence=0,
            gateway_heartbeat=0,
            control=Control(0),
            mode=Mode.ROAD_LOAD,
            speed_setpoint=0.0,
            speed_rate=0.0,
            ramp_limit=1000 * RPM,
            current_limit=72.0,
            watchdog_timeout=0.2,
        )
    )

    def write(self, **changes: object) -> None:
        """Send the next command."""
        number = self.setpoint.command_sequence + 1
        changed = {"command_sequence": number, "gateway_heartbeat": number, **changes}
        self.setpoint = replace(self.setpoint, **changed)  # type: ignore[arg-type]
        self.words = encode_setpoint(self.plc.register_map, self.setpoint)

    def write_raw(self, place: int, word: int) -> None:
        """Send the next command with one word replaced."""
        self.write()
        assert self.words is not None
        words = list(self.words)
        words[place] = word
        # The checksum is optional; 0 means that there is none.
        words[10:12] = [0, 0]
        self.words = tuple(words)

    def scan(self, count: int = 1) -> Measurement:
        """Run so many scans; return the last measurement."""
        for _ in range(count):
            shown = self.plc.scan(self.words, self.switches)
        return shown

    def beat(self, scans: int, **changes: object) -> Measurement:
        """Run so many scans with a new command before each; return the last measurement."""
        for _ in range(scans):
            self.write(**changes)
            shown = self.scan()
        return shown


def desk(register_map=INT16, **surroundings) -> Desk:
    bench = LinearBench()
    return Desk(Plc(bench, register_map, backlash=BACKLASH, **surroundings))


@pytest.fixture
def running() -> Desk:
    """A PLC in road-load, at standstill."""
    made = desk()
    made.scan(2)
    made.beat(1, control=Control.ENABLE)
    assert made.plc.state is PlcState.ROAD_LOAD
    return made


def test_first_scan_shows_ready_and_10_ms():
    shown = desk().scan()
    assert shown.plc_state is PlcState.READY
    assert shown.plc_time == 0.01
    assert shown.status & (Status.READY | Status.ENABLED) == Status.READY


def test_sequence_and_heartbeat_count_scans_at_both_ends_of_the_block():
    shown = desk().scan(3)
    assert (shown.sequence_start, shown.plc_heartbeat, shown.sequence_end) == (3, 3, 3)


def test_every_word_of_both_maps_can_be_shown_after_65536_scans():
    for register_map in (INT16, FLOAT32):
        made = desk(register_map)
        made.scan()
        made.plc.scans += 65536
        shown = decode_measurement(register_map, encode_measurement(register_map, made.scan()))
        assert shown.sequence_start == 2
        assert shown.plc_time == pytest.approx(655.38)


def test_enable_edge_in_remote_starts_road_load():
    made = desk()
    made.scan(2)
    shown = made.beat(1, control=Control.ENABLE)
    assert shown.plc_state is PlcState.ROAD_LOAD
    assert shown.status & (Status.ENABLED | Status.ROAD_LOAD) == Status.ENABLED | Status.ROAD_LOAD


def test_mode_speed_enables_without_road_load():
    made = desk()
    made.scan(2)
    shown = made.beat(1, control=Control.ENABLE, mode=Mode.SPEED)
    assert shown.plc_state is PlcState.SPEED
    assert shown.status & (Status.ENABLED | Status.ROAD_LOAD) == Status.ENABLED


def test_mode_may_change_while_running(running):
    assert running.beat(1, mode=Mode.SPEED).plc_state is PlcState.SPEED
    assert running.beat(1, mode=Mode.ROAD_LOAD).plc_state is PlcState.ROAD_LOAD


def test_enable_edge_in_local_is_lost():
    made = desk()
    made.switches = Switches(remote=False)
    made.scan(2)
    made.beat(1, control=Control.ENABLE)
    made.switches = Switches(remote=True)
    assert made.beat(5).plc_state is PlcState.READY
    made.beat(1, control=Control(0))
    assert made.beat(1, control=Control.ENABLE).plc_state is PlcState.ROAD_LOAD


def test_reference_goes_to_the_setpoint_no_faster_than_the_slew_limit(running):
    # 1000 rpm/s for 20 ms are 20 rpm.
    shown = running.beat(2, speed_setpoint=300 * RPM)
    assert shown.speed_reference == pytest.approx(20 * RPM)
    assert Status.AT_LIMIT in shown.status
    assert running.beat(60).speed_reference == pytest.approx(300 * RPM)


@pytest.mark.parametrize(
    ("asked", "given"), [(5000, 4830), (4831, 4830), (4830, 4830), (-1, 0), (-50, 0), (0, 0)]
)
def test_reference_is_clamped_to_0_to_4830_rpm(running, asked, given):
    running.setpoint = replace(running.setpoint, ramp_limit=65000 * RPM)
    running.write_raw(SPEED_REF, 5 * asked & 0xFFFF)
    shown = running.scan(15)
    assert shown.speed_reference == pytest.approx(given * RPM, abs=1e-9)
    assert (Status.AT_LIMIT in shown.status) == (asked != given)
    assert not shown.alarm


def test_setpoint_goes_on_along_its_slope_between_two_writes(running):
    running.write(speed_setpoint=100 * RPM, speed_rate=500 * RPM, ramp_limit=60000 * RPM)
    # The scan that reads the command plans the next 10 ms: 100 + 500 * 0.01.
    assert running.scan().speed_reference == pytest.approx(105 * RPM)
    assert running.scan(3).speed_reference == pytest.approx(120 * RPM)
    path = running.plc.bench.references[-10:]
    steps = {round((b - a) / RPM, 6) for a, b in itertools.pairwise(path)}
    assert steps == {0.5}


def test_slope_ends_after_100_ms_so_that_a_dead_gateway_cannot_ramp_away(running):
    running.write(
        speed_setpoint=100 * RPM, speed_rate=500 * RPM, ramp_limit=60000 * RPM, watchdog_timeout=1.0
    )
    assert running.scan(90).speed_reference == pytest.approx(150 * RPM)


def test_watchdog_ramps_down_at_the_ramp_limit_and_then_is_ready(running):
    running.beat(100, speed_setpoint=500 * RPM)
    # The command came at scan 0. 200 ms later the heartbeat is 200 ms old and still valid.
    assert running.scan(20).plc_state is PlcState.ROAD_LOAD
    shown = running.scan()
    assert shown.plc_state is PlcState.RAMP_DOWN
    assert Alarm.COMMUNICATION in shown.alarm
    assert Status.WATCHDOG_OK not in shown.status
    assert Status.ENABLED not in shown.status
    # 500 rpm at 1000 rpm/s take 0.5 s, or 50 scans; the scan above was the first of them.
    assert running.scan(48).plc_state is PlcState.RAMP_DOWN
    assert running.scan(2).plc_state is PlcState.READY


@pytest.mark.parametrize("timeout", [0.05, 0.2, 1.0])
def test_watchdog_bites_in_the_first_scan_after_its_time(running, timeout):
    running.beat(1, watchdog_timeout=timeout)
    scans = 0
    while running.plc.state is PlcState.ROAD_LOAD:
        running.scan()
        scans += 1
    assert scans == round(timeout / 0.01) + 1


def test_commands_with_a_still_heartbeat_do_not_feed_the_watchdog(running):
    running.write()
    still = running.setpoint.gateway_heartbeat
    assert running.scan().plc_state is PlcState.ROAD_LOAD
    assert running.beat(21, gateway_heartbeat=still).plc_state is PlcState.RAMP_DOWN


def test_after_the_watchdog_only_a_new_enable_edge_starts_again(running):
    running.scan(40)
    assert running.beat(5).plc_state is PlcState.READY
    running.beat(1, control=Control(0))
    assert running.beat(1, control=Control.ENABLE).plc_state is PlcState.ROAD_LOAD


def test_edge_during_the_ramp_down_is_lost(running):
    running.beat(100, speed_setpoint=500 * RPM)
    running.beat(1, control=Control(0))
    assert running.beat(1, control=Control.ENABLE).plc_state is PlcState.RAMP_DOWN
    assert running.beat(100).plc_state is PlcState.READY


def test_repeat_of_a_command_sequence_is_ignored(running):
    repeated = running.setpoint.command_sequence
    age = running.scan().command_age
    running.write(command_sequence=repeated, speed_setpoint=400 * RPM)
    shown = running.scan()
    assert shown.speed_reference == 0.0
    assert shown.command_age == pytest.approx(age + 0.01)
    assert not shown.alarm


@pytest.mark.parametrize(
    ("place", "word", "what"),
    [
        (VERSION, 2, "map version 2"),
        (WATCHDOG, 0, "watchdog 0 s"),
        (WATCHDOG, 49, "watchdog 0.049 s"),
        (WATCHDOG, 1001, "watchdog 1.001 s"),
        (CURRENT, 7201, "current limit 72.01 A"),
        (CURRENT, 0, "current limit 0 A"),
        (RAMP, 0, "ramp limit 0"),
        (MODE, 9, "MODE"),
        (MODE, 2, "WARM_UP"),
        (MODE, 5, "COASTDOWN"),
        (CTRL, 0b0101, "ZERO_TORQUE"),
        (CTRL, 0b1001, "COAST"),
    ],
)
def test_bad_command_is_refused_whole_and_the_last_one_kept(running, place, word, what):
    running.beat(1, speed_setpoint=3 * RPM)
    accepted = running.setpoint.command_sequence
    running.write_raw(place, word)
    shown = running.scan()
    assert Alarm.SETPOINT_REJECTED in shown.alarm
    assert shown.command_sequence_echo == accepted
    assert shown.command_age == pytest.approx(0.01)
    assert shown.plc_state is PlcState.ROAD_LOAD
    assert shown.speed_reference == pytest.approx(3 * RPM)
    assert what in running.plc.inbox.refusal


@pytest.mark.parametrize("place", [WATCHDOG, CURRENT])
@pytest.mark.parametrize("end", [0, 1])
def test_ends_of_the_allowed_ranges_are_accepted(running, place, end):
    running.write_raw(place, {WATCHDOG: (50, 1000), CURRENT: (1, 7200)}[place][end])
    assert not running.scan().alarm


def test_current_limit_of_an_accepted_command_reaches_the_drive(running):
    running.write_raw(CURRENT, 2050)
    running.scan()
    assert running.plc.bench.current_limit == pytest.approx(20.5)
    running.write_raw(CURRENT, 7201)
    running.scan()
    assert running.plc.bench.current_limit == pytest.approx(20.5)


@pytest.mark.parametrize("words", [(0x7FC0, 0), (0x7F80, 0), (0xFF80, 0), (0, 1)])
def test_float_that_is_no_number_is_refused_at_every_place(words):
    # NaN, both infinities and the smallest subnormal, at the floats of the command block.
    for address in (196, 198, 200, 202):
        made = desk(FLOAT32)
        made.scan(2)
        made.beat(1, control=Control.ENABLE)
        made.write()
        changed = list(made.words)
        changed[address - 192 : address - 190] = words
        made.words = tuple(changed)
        shown = made.scan()
        assert Alarm.SETPOINT_REJECTED in shown.alarm
        assert shown.plc_state is PlcState.ROAD_LOAD


def test_wrong_checksum_is_refused_and_no_checksum_is_not(running):
    running.write()
    good = running.words
    running.words = (*good[:11], good[11] ^ 1, *good[12:])
    assert Alarm.SETPOINT_REJECTED in running.scan().alarm
    running.switches = Switches(remote=False)
    assert not running.scan().alarm
    running.write_raw(HB, 7)
    assert not running.scan().alarm


def test_gateway_that_sends_only_rubbish_meets_the_watchdog(running):
    for _ in range(21):
        running.write_raw(WATCHDOG, 0)
        running.scan()
    assert running.plc.state is PlcState.RAMP_DOWN


def test_command_age_stays_at_what_its_register_can_show():
    made = desk()
    assert made.scan().command_age == pytest.approx(65.535)
    made.beat(1)
    assert made.scan(7).command_age == pytest.approx(0.07)


def test_taking_remote_away_ramps_down(running):
    running.beat(100, speed_setpoint=500 * RPM)
    running.switches = Switches(remote=False)
    shown = running.beat(1)
    assert shown.plc_state is PlcState.RAMP_DOWN
    assert Status.REMOTE not in shown.status


@pytest.mark.parametrize("open_one", list(Interlock))
def test_each_open_interlock_stops_at_once_and_is_a_fault(running, open_one):
    running.beat(100, speed_setpoint=500 * RPM)
    running.switches = Switches(remote=True, interlock=CLOSED & ~open_one)
    shown = running.beat(1)
    assert shown.plc_state is PlcState.FAULT
    assert shown.speed_reference == 0.0
    assert Status.FAULT in shown.status
    assert (Status.EMERGENCY_STOP_OK in shown.status) == (open_one != Interlock.EMERGENCY_STOP)


def test_fault_is_reset_by_an_edge_and_only_after_its_cause_is_gone(running):
    running.switches = Switches(remote=True, interlock=CLOSED & ~Interlock.DOOR)
    running.beat(1)
    assert running.beat(1, control=Control.FAULT_RESET).plc_state is PlcState.FAULT
    running.switches = Switches(remote=True)
    assert running.beat(3).plc_state is PlcState.FAULT
    running.beat(1, control=Control(0))
    assert running.beat(1, control=Control.FAULT_RESET).plc_state is PlcState.READY


def test_overspeed_trips_above_105_percent_of_4830_rpm(running):
    running.beat(1, speed_setpoint=4830 * RPM, ramp_limit=65000 * RPM)
    running.plc.bench.push = 0.049 * 4830 * RPM
    assert running.beat(20).plc_state is PlcState.ROAD_LOAD
    running.plc.bench.push = 0.051 * 4830 * RPM
    shown = running.beat(1)
    assert shown.plc_state is PlcState.FAULT
    assert Alarm.OVERSPEED in shown.alarm


def test_ramp_down_lasts_until_the_motor_stands(running):
    running.plc.bench.push = 5.0
    assert running.beat(20, control=Control(0)).plc_state is PlcState.RAMP_DOWN
    running.plc.bench.push = 0.0
    assert running.beat(2).plc_state is PlcState.READY


def test_alarm_stays_until_the_operator_moves_the_remote_switch(running):
    running.write_raw(WATCHDOG, 0)
    running.scan()
    assert running.beat(5).alarm == Alarm.SETPOINT_REJECTED
    running.switches = Switches(remote=False)
    assert not running.beat(1).alarm


def test_mean_torque_is_over_exactly_the_window_of_the_speeds():
    # The torque rises from 0 by 1 N m per millisecond: its mean over scan k is 10 k - 5.
    made = desk()
    assert made.scan().shaft_torque_mean == pytest.approx(5.0)
    shown = made.scan()
    assert shown.shaft_torque == 20.0
    assert shown.shaft_torque_mean == pytest.approx(15.0)
    # Integral of 1000 t from 0 to 20 ms.
    assert shown.shaft_torque_integral == pytest.approx(0.2)


def test_counters_count_4096_pulses_a_revolution_and_wrap(running):
    running.plc.bench.angle = 2**32 * 2 * pi / 4096 + 0.001
    words = encode_measurement(INT16, running.beat(1))
    # MOT_COUNT: one pulse is 1.5 mrad
    assert words[22:24] == (0, 0)


def test_gap_bit_is_set_between_the_flanks(running):
    assert Status.GAP in running.beat(1).status
    running.plc.backlash = replace(BACKLASH, start=0.2)
    assert Status.GAP not in running.beat(1).status


class Diary:
    """A driver that records the times and speeds of all calls."""

    def __init__(self) -> None:
        self.asked: list[tuple[float, float]] = []

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        self.asked.append((round(time, 6), speed))
        return 100.0, 3.0


def test_driver_sets_off_with_road_load_and_gets_off_after_it():
    diaries = []

    def board() -> Diary:
        diaries.append(Diary())
        return diaries[-1]

    made = desk(truck=Truck(board, drum_radius=0.645))
    made.scan(3)
    assert not diaries
    made.beat(3, control=Control.ENABLE)
    assert [time for time, _ in diaries[0].asked] == [0.0, 0.01]
    assert made.plc.bench.wheel[-1] == (100.0, 3.0)
    made.beat(2, control=Control(0))
    assert made.plc.bench.wheel[-1][0] == 0.0
    made.beat(2, control=Control.ENABLE)
    assert len(diaries) == 2


def test_truck_without_a_driver_is_parked_once_the_drum_stands():
    made = desk(truck=Truck(Diary, drum_radius=0.645))
    made.scan(3)
    assert made.plc.bench.wheel[1:] == [(0.0, 300.0)] * 2
    made.beat(100, control=Control.ENABLE, mode=Mode.SPEED, speed_setpoint=300 * RPM)
    assert made.plc.bench.wheel[-1] == (0.0, 0.0)
    made.beat(5, control=Control(0))
    assert made.plc.bench.wheel[-1] == (0.0, 0.0)
    made.beat(100)
    assert made.plc.bench.wheel[-1] == (0.0, 300.0)


def test_driver_gets_the_speed_of_the_tread():
    diary = Diary()
    made = desk(truck=Truck(lambda: diary, drum_radius=0.645))
    made.scan(2)
    made.beat(100, control=Control.ENABLE, speed_setpoint=376.0, ramp_limit=6000.0)
    # 376 rad/s are 6.0064 rad/s at the drum, or 3.8741 m/s; one digit of the map is 0.2 rpm.
    assert diary.asked[-1][1] == pytest.approx(3.8741, abs=3e-4)


@pytest.mark.parametrize("state", list(PlcState))
def test_a_trip_leads_to_fault_from_everywhere(state):
    assert TRANSITIONS[state, Event.TRIPPED] is PlcState.FAULT


def test_only_ready_starts():
    starts = {state for state, event in TRANSITIONS if event.name.startswith("START_")}
    assert starts == {PlcState.READY}


def test_every_state_that_is_entered_can_be_left():
    left = {state for state, _ in TRANSITIONS}
    assert set(TRANSITIONS.values()) <= left


def test_scan_time_is_shown_up_to_what_its_register_holds():
    made = desk()
    assert made.plc.scan(None, Switches(), 0.0021).scan_time_max == 0.0021
    assert made.plc.scan(None, Switches(), 60.0).scan_time_max == pytest.approx(6.5535)


WORDS = st.one_of(st.just(0), st.integers(0, 10), st.integers(0, 65535))


@pytest.mark.slow
@given(
    blocks=st.lists(st.lists(WORDS, min_size=16, max_size=16), max_size=20),
    start=st.integers(0, 4830 * 5),
)
def test_no_command_gets_the_reference_out_of_range_or_over_its_slew_limit(blocks, start):
    made = desk()
    made.scan(2)
    made.beat(1, control=Control.ENABLE, speed_setpoint=start * 0.2 * RPM)
    for number, block in enumerate(blocks, start=2):
        # These words are valid, because a bad one is refused at once; the others are arbitrary.
        block[0], block[VERSION], block[10:12] = number, 1, [0, 0]
        made.words = tuple(block)
        before = made.plc.path[-1]
        encode_measurement(INT16, made.scan())
        path = [before, *made.plc.path]
        slew = made.plc.inbox.command.slew
        assert all(0.0 <= speed <= 4830 * RPM + 1e-9 for speed in path)
        assert all(abs(b - a) <= slew * 1e-3 + 1e-9 for a, b in itertools.pairwise(path))
