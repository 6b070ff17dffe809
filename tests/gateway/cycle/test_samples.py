"""Which readings are news, and what lies between two of them. Numbers by hand."""

from dataclasses import replace
from math import inf, nan

import pytest

from gateway.configuration.config import Config
from gateway.cycle import samples
from gateway.cycle.samples import Samples
from gateway.friction.law import friction_torque
from gateway.reasons import Reason
from register_maps import load
from register_maps.signals import Measurement, Status

MAP = load("bench_int16")
CONFIG = Config()
FIRST = Measurement(
    sequence_start=7,
    sequence_end=7,
    plc_heartbeat=7,
    plc_time=1.0,
    status=Status.READY,
    motor_speed=100.0,
    drum_speed=1.6,
    shaft_torque=-9.0,
    shaft_torque_mean=-8.0,
    shaft_torque_integral=50.0,
)
LATER = replace(
    FIRST,
    sequence_start=10,
    sequence_end=10,
    plc_heartbeat=10,
    plc_time=1.03,
    drum_speed=1.63,
    shaft_torque_integral=49.79,
)


def after(*readings, begin=100.0, config=CONFIG, every=0.01):
    seen = Samples()
    for number, reading in enumerate(readings):
        fault = None if isinstance(reading, Measurement) else reading
        seen = samples.take(seen, None if fault else reading, fault, begin + every * number)
        seen = samples.with_window(config, MAP, seen)
    return seen


def between(before, now, **values):
    config = CONFIG.with_values({f"regulator.{key}": value for key, value in values.items()})
    return after(before, now, config=config).window


def test_a_window_spans_lost_samples_by_the_clock_of_the_plc():
    window = between(FIRST, LATER)
    assert window.duration == pytest.approx(0.03)
    assert window.drum_speed_change == pytest.approx(0.03)
    assert window.shaft_torque == pytest.approx(-7.0)


@pytest.mark.parametrize(
    ("kind", "torque"), [("integrated", -7.0), ("averaged", -8.0), ("instantaneous", -9.0)]
)
def test_each_choice_of_torque_reads_its_signal(kind, torque):
    assert between(FIRST, LATER, torque=kind).shaft_torque == pytest.approx(torque)


def test_the_offset_of_the_sensor_is_taken_off():
    assert between(FIRST, LATER, torque_offset_Nm="0.5").shaft_torque == pytest.approx(-7.5)


def test_gain_and_lag_of_the_sensor_are_taken_out():
    """-7 N m shown in the mean, rising 3 N m/s at a lag of 0.1 s: -6.7; the gain shows 1.25."""
    later = replace(LATER, shaft_torque=FIRST.shaft_torque + 0.09)
    told = between(FIRST, later, torque_lag_ms=100.0, torque_gain_percent=25.0)
    assert told.shaft_torque == pytest.approx(-6.7 / 1.25)


def test_oil_begins_at_the_shell_and_warms_from_window_to_window():
    last = replace(LATER, sequence_start=13, sequence_end=13, plc_time=1.06)
    readings = [replace(one, shell_temperature_1=300.0) for one in (FIRST, LATER, last)]
    assert after(*readings[:2]).window.oil_temperature == 300.0
    law, gear_speed = CONFIG.regulator.friction, 100.0 / 62.6
    heat = friction_torque(gear_speed, law, 300.0, 300.0) * gear_speed
    warmed = after(*readings, every=0.03).window.oil_temperature - 300.0
    assert warmed == pytest.approx(0.03 * heat / law.gear_oil_temperature.heat_capacity, rel=1e-3)


def test_a_sample_without_its_torque_falls_back_to_that_at_its_end():
    assert between(FIRST, replace(LATER, shaft_torque_integral=None)).shaft_torque == -9.0


def test_clock_and_integral_may_wrap_in_between():
    """32 bits of 0.1 ms, and of 0.0001 N m s from -2^31 on."""
    span = 2.0**32 * 1e-4
    before = replace(FIRST, plc_time=span - 0.01, shaft_torque_integral=-span / 2 + 0.06)
    now = replace(LATER, plc_time=0.02, shaft_torque_integral=span / 2 - 0.15)
    window = between(before, now)
    assert window.duration == pytest.approx(0.03)
    assert window.shaft_torque == pytest.approx(-7.0)


@pytest.mark.parametrize("plc_time", [1.0, 0.99])
def test_a_clock_that_does_not_advance_makes_no_window(plc_time):
    assert between(FIRST, replace(LATER, plc_time=plc_time)) is None


def test_the_same_sample_again_is_no_window_but_keeps_the_next_one_whole():
    assert between(FIRST, FIRST) is None
    seen = after(FIRST, FIRST, LATER)
    assert seen.window.duration == pytest.approx(0.03)
    assert (seen.before_came, seen.used) == (100.0, 100.02)


@pytest.mark.parametrize(
    ("first", "second", "mean"), [(300.0, 310.0, 305.0), (300.0, None, 300.0), (None, None, None)]
)
def test_shell_temperature_is_the_mean_of_the_thermocouples_that_work(first, second, mean):
    now = replace(LATER, shell_temperature_1=first, shell_temperature_2=second)
    assert between(FIRST, now).shell_temperature == mean


def test_before_the_first_sample_there_is_nothing():
    assert samples.fault(Samples(), 0.0, 0.1) is Reason.STALE
    assert (Samples().heartbeat_moved, Samples().sequence_moved) == (-inf, -inf)
    assert Samples().age(0.0) == inf
    assert not Samples().is_new
    assert not Samples().down
    assert (Samples().used, Samples().before_came, Samples().ahead) == (-inf, -inf, 0.0)
    assert after(FIRST).window is None


def test_one_sample_alone_is_none_that_could_be_used():
    assert samples.fault(after(FIRST), 100.0, 0.1) is Reason.STALE


def test_a_lost_link_is_told_at_once_and_a_lost_poll_only_when_stale():
    assert samples.fault(after(FIRST, LATER, Reason.CONNECTION_LOST), 100.02, 0.1) is (
        Reason.CONNECTION_LOST
    )
    lost = after(FIRST, LATER, Reason.TIMEOUT)
    assert samples.fault(lost, 100.105, 0.1) is None
    assert samples.fault(lost, 100.115, 0.1) is Reason.TIMEOUT


def test_a_good_sample_forgets_the_faults_before_it():
    seen = after(FIRST, Reason.TIMEOUT, LATER)
    assert samples.fault(seen, 100.02, 0.1) is None
    assert seen.fault is None


def test_a_torn_image_is_no_sample():
    torn = after(FIRST, replace(LATER, sequence_end=9))
    assert torn.newest == FIRST
    assert samples.fault(torn, 100.2, 0.1) is Reason.TORN_IMAGE


@pytest.mark.parametrize(
    ("moving", "reason"),
    [
        ("sequence_start", Reason.HEARTBEAT_FROZEN),
        ("plc_heartbeat", Reason.SEQUENCE_FROZEN),
    ],
)
def test_it_is_told_which_of_heartbeat_and_sequence_stands_still(moving, reason):
    later = replace(FIRST, **{moving: 8})
    later = replace(later, sequence_end=later.sequence_start)
    assert samples.fault(after(FIRST, later), 100.105, 0.1) is reason


def test_a_sample_of_exactly_the_stale_age_is_still_fresh():
    seen = after(FIRST, LATER, begin=0.0, every=0.0)
    assert samples.fault(seen, 0.1, 0.1) is None


def test_of_an_image_that_stands_still_altogether_the_heartbeat_is_named():
    assert samples.fault(after(FIRST), 100.2, 0.1) is Reason.HEARTBEAT_FROZEN


TORN = replace(LATER, sequence_end=9)


@pytest.mark.parametrize("reading", [Reason.TIMEOUT, TORN])
def test_a_lost_or_torn_reading_is_no_news(reading):
    seen = after(FIRST, LATER, reading)
    assert not seen.is_new
    assert seen.window is None


def test_a_torn_image_shows_that_the_link_is_back():
    assert not after(FIRST, Reason.CONNECTION_LOST, TORN).down


def later(number, *, duration=0.01, torque=-8.0, mean=-8.0):
    """The sample of that number after FIRST, with a steady clock and torque."""
    return replace(
        FIRST,
        sequence_start=7 + number,
        sequence_end=7 + number,
        plc_heartbeat=7 + number,
        plc_time=1.0 + duration * number,
        shaft_torque_mean=mean,
        shaft_torque_integral=50.0 + torque * duration * number,
    )


@pytest.mark.parametrize(
    ("duration", "every", "reason"),
    [
        (0.11, 0.01, None),
        (0.13, 0.01, Reason.PLC_CLOCK),
        (3600.0, 0.01, Reason.PLC_CLOCK),
        (0.001, 0.01, None),
        (0.01, 0.11, None),
        (0.01, 0.13, Reason.PLC_CLOCK),
        (1.0, 1.0, None),
        (0.5, 0.3, None),
        (1.0, 2.2, Reason.PLC_CLOCK),
        (0.0, 0.01, Reason.PLC_CLOCK),
        (-0.001, 0.01, Reason.PLC_RESTARTED),
    ],
)
def test_a_window_may_differ_from_our_clock_by_half_of_the_longer_and_50_ms(
    duration, every, reason
):
    seen = after(FIRST, later(1, duration=duration), every=every)
    assert (seen.window is None) is (reason is not None)
    assert seen.window_fault is (reason or Reason.STALE)


def test_a_window_exactly_as_far_from_our_clock_as_may_be_is_used():
    """Half of 0.25 s and 0.05 s are 0.175 s; the difference of 0.25 s and 0.075 s."""
    assert samples._in_step(0.25, 0.25 - (0.5 * 0.25 + 0.05))
    assert not samples._in_step(0.0, 0.0)


@pytest.mark.parametrize(
    ("rate", "used"), [(0.45, False), (0.55, True), (1.0, True), (1.45, True), (1.55, False)]
)
def test_a_clock_is_refused_when_it_is_off_by_half_for_long(rate, used):
    """Ten seconds at 100 Hz: what is ahead goes to half of (rate - 1) s, which is remembered."""
    seen = after(FIRST, *(later(number, duration=0.01 * rate) for number in range(1, 1001)))
    assert (seen.window is not None) is used
    assert seen.ahead == pytest.approx(0.5 * (rate - 1.0), rel=0.02)


def test_what_a_clock_is_ahead_is_forgotten_to_the_13_5_hundredths_in_a_second():
    """exp(-2) = 0.1353353."""
    begin = replace(after(FIRST), ahead=0.5)
    seen = samples.take(begin, replace(LATER, plc_time=2.0), None, 101.0)
    assert samples.with_window(CONFIG, MAP, seen).ahead == pytest.approx(0.06766764)


@pytest.mark.parametrize(("ahead", "used"), [(0.25, True), (-0.25, True), (0.251, False)])
def test_a_quarter_of_a_second_ahead_is_just_not_too_much(ahead, used):
    """No time passes for us, a quarter of a millisecond for the PLC."""
    begin = replace(after(FIRST), ahead=ahead - 2.0**-12)
    now = replace(LATER, plc_time=1.0 + 2.0**-12, shaft_torque_integral=None)
    seen = samples.with_window(CONFIG, MAP, samples.take(begin, now, None, 100.0))
    assert seen.ahead == pytest.approx(ahead, abs=1e-12)
    assert (seen.window is not None) is used


def test_a_step_of_the_clock_is_left_out_and_the_next_window_used():
    steps = [replace(later(n), plc_time=later(n).plc_time + 3600.0) for n in (2, 3)]
    first = after(FIRST, later(1), steps[0])
    assert (first.window, first.window_fault, first.used) == (None, Reason.PLC_CLOCK, 100.01)
    assert after(FIRST, later(1), *steps).window.duration == pytest.approx(0.01)


@pytest.mark.parametrize(("torque", "used"), [(327.6, True), (327.7, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_mean_that_the_sensor_cannot_show_is_no_torque(torque, used, sign):
    """The register holds 327.67 N m either way."""
    seen = after(FIRST, later(1, torque=sign * torque, mean=None))
    assert (seen.window is not None) is used
    assert seen.window_fault is (Reason.STALE if used else Reason.TORQUE_IMPLAUSIBLE)


def test_the_sensors_range_itself_is_inside():
    assert samples._is_possible(MAP, 327.67, None, 0.01)
    assert samples._is_possible(MAP, -327.67, None, 0.01)


def test_no_number_is_no_torque():
    assert after(FIRST, replace(LATER, shaft_torque_integral=nan)).window is None


def test_a_map_without_a_torque_leaves_its_range_open():
    kept = tuple(one for one in MAP.registers if one.signal != "shaft_torque")
    bare = replace(MAP, registers=kept)
    assert samples._is_possible(bare, 1000.0, None, 0.01)


@pytest.mark.parametrize(
    ("duration", "apart", "used"),
    [
        (0.01, 20.0, True),
        (0.01, 20.1, False),
        (0.01, -20.0, True),
        (0.01, -20.1, False),
        (0.005, 20.0, True),
        (0.005, 20.1, False),
        (0.02, 120.0, True),
        (0.02, 120.1, False),
        (0.04, 169.0, True),
        (0.04, 171.0, False),
    ],
)
def test_a_mean_may_differ_from_that_of_the_last_scan_as_the_rest_of_the_window_allows(
    duration, apart, used
):
    """20 N m, and 200 N m times the share of the window that lies before the last scan."""
    assert samples._is_possible(MAP, 10.0 + apart, 10.0, duration) is used


def test_windows_that_cannot_be_used_make_stale_what_is_fresh():
    still = [replace(later(n), plc_time=1.01) for n in range(2, 13)]
    seen = after(FIRST, later(1), *still)
    assert seen.age(100.12) == 0.0
    assert samples.fault(seen, 100.1, 0.1) is None
    assert samples.fault(seen, 100.12, 0.1) is Reason.PLC_CLOCK


def test_a_window_of_exactly_the_stale_age_is_still_of_use():
    seen = replace(after(FIRST, LATER, begin=0.0, every=0.0), heartbeat_moved=0.1)
    assert samples.fault(replace(seen, sequence_moved=0.1), 0.1, 0.1) is None


def restarted(before, now, every=0.03):
    """Whether the PLC counts as restarted between two readings this far apart [s]."""
    return after(before, now, every=every).restarted > -inf


def changed(**values):
    return replace(LATER, **values)


@pytest.mark.parametrize("plc_time", [0.99, 0.0, 0.9999])
def test_clock_that_jumps_back_is_a_restart(plc_time):
    assert restarted(FIRST, changed(plc_time=plc_time))


def test_sample_number_that_jumps_back_is_a_restart():
    assert restarted(FIRST, changed(sequence_start=6, sequence_end=6))
    assert not restarted(FIRST, changed(sequence_start=8, sequence_end=8))


def test_sample_number_that_starts_anew_behind_the_middle_of_its_range_is_a_restart():
    """40000 samples of 10 ms after its start; from 40000 to 1 are 25537 steps forward."""
    old = replace(FIRST, sequence_start=40000, sequence_end=40000)
    assert restarted(old, changed(sequence_start=1, sequence_end=1))


@pytest.mark.parametrize(("ahead", "found"), [(599, False), (600, True)])
def test_sample_number_may_lead_by_less_than_a_scan_of_1_ms_allows_and_100(ahead, found):
    """0.5 s between the readings."""
    number = FIRST.sequence_start + ahead
    now = changed(sequence_start=number, sequence_end=number, plc_time=1.5)
    assert restarted(FIRST, now, every=0.5) is found


def test_sample_number_that_does_not_move_follows_none():
    seen = replace(after(FIRST, LATER), is_new=True, before=LATER)
    still = replace(seen, newest=replace(LATER, plc_time=LATER.plc_time + 0.01))
    assert samples.with_window(CONFIG, MAP, still).window_fault is Reason.PLC_RESTARTED


def test_sample_number_that_wraps_is_no_restart():
    old = replace(FIRST, sequence_start=65535, sequence_end=65535)
    assert not restarted(old, changed(sequence_start=2, sequence_end=2))


def test_no_sample_counts_as_fresh_for_a_second_after_a_restart():
    seen = after(
        FIRST,
        later(1, duration=-0.5),
        replace(later(2), plc_time=0.51, shaft_torque_integral=53.92),
    )
    assert samples.fault(seen, 101.01, 5.0) is Reason.PLC_RESTARTED
    assert samples.fault(seen, 101.02, 5.0) is None


def test_restart_over_a_lost_link_is_noticed_with_the_first_sample():
    lost = [Reason.CONNECTION_LOST] * 50
    seen = after(FIRST, *lost, changed(plc_time=0.0))
    assert samples.fault(seen, seen.sequence_moved, 0.1) is Reason.PLC_RESTARTED


def test_last_fault_is_told_when_the_first_is_history():
    """The port refuses since a second: the time-out at its begin is no longer what is wrong."""
    seen = after(FIRST, LATER, Reason.TIMEOUT, Reason.NOT_CONNECTED)
    assert samples.fault(seen, 101.01, 0.1) is Reason.TIMEOUT
    assert samples.fault(seen, 101.02, 0.1) is Reason.NOT_CONNECTED


def test_before_any_sample_the_last_fault_is_told():
    seen = after(Reason.TIMEOUT, Reason.NOT_CONNECTED, Reason.EXCEPTION_2)
    assert samples.fault(seen, 100.02, 0.1) is Reason.EXCEPTION_2
