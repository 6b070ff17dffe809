"""Which readings are news, and what lies between two of them. Numbers by hand."""

from dataclasses import replace
from math import inf

import pytest

from gateway import samples
from gateway.config import Config
from gateway.reasons import Reason
from gateway.samples import Samples
from register_maps import load
from register_maps.signals import Measurement, Status

MAP = load("bench_int16")
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


def after(*readings, begin=100.0):
    seen = Samples()
    for number, reading in enumerate(readings):
        fault = None if isinstance(reading, Measurement) else reading
        seen = samples.take(seen, None if fault else reading, fault, begin + 0.01 * number)
    return seen


def between(before, now, **values):
    config = Config().with_values({f"regulator.{key}": value for key, value in values.items()})
    return samples.window(config, MAP, after(before, now))


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
    window = samples.window(Config(), MAP, after(FIRST, FIRST, LATER))
    assert window.duration == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("first", "second", "mean"), [(300.0, 310.0, 305.0), (300.0, None, 300.0), (None, None, None)]
)
def test_shell_temperature_is_the_mean_of_the_thermocouples_that_work(first, second, mean):
    now = replace(LATER, shell_temperature_1=first, shell_temperature_2=second)
    assert between(FIRST, now).shell_temperature == mean


def test_before_the_first_sample_there_is_nothing():
    assert samples.complaint(Samples(), 0.0, 0.1) is Reason.STALE
    assert (Samples().heartbeat_moved, Samples().sequence_moved) == (-inf, -inf)
    assert Samples().age(0.0) == inf
    assert not Samples().is_new
    assert samples.window(Config(), MAP, after(FIRST)) is None


def test_a_lost_link_is_told_at_once_and_a_lost_poll_only_when_stale():
    assert samples.complaint(after(FIRST, Reason.CONNECTION_LOST), 100.01, 0.1) is (
        Reason.CONNECTION_LOST
    )
    lost = after(FIRST, Reason.TIMEOUT)
    assert samples.complaint(lost, 100.1, 0.1) is None
    assert samples.complaint(lost, 100.11, 0.1) is Reason.TIMEOUT


def test_a_good_sample_forgets_the_faults_before_it():
    seen = after(FIRST, Reason.TIMEOUT, LATER)
    assert samples.complaint(seen, 100.02, 0.1) is None
    assert seen.fault is None


def test_a_torn_image_is_no_sample():
    torn = after(FIRST, replace(LATER, sequence_end=9))
    assert torn.newest == FIRST
    assert samples.complaint(torn, 100.2, 0.1) is Reason.TORN_IMAGE


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
    assert samples.complaint(after(FIRST, later), 100.105, 0.1) is reason


def test_a_sample_of_exactly_the_stale_age_is_still_fresh():
    seen = after(FIRST, begin=0.0)
    assert samples.complaint(seen, 0.1, 0.1) is None


def test_of_an_image_that_stands_still_altogether_the_heartbeat_is_named():
    assert samples.complaint(after(FIRST), 100.2, 0.1) is Reason.HEARTBEAT_FROZEN


TORN = replace(LATER, sequence_end=9)


@pytest.mark.parametrize("reading", [Reason.TIMEOUT, TORN])
def test_a_lost_or_torn_reading_is_no_news(reading):
    seen = after(FIRST, LATER, reading)
    assert not seen.is_new
    assert samples.window(Config(), MAP, seen) is None


def test_a_torn_image_shows_that_the_link_is_back():
    assert not after(FIRST, Reason.CONNECTION_LOST, TORN).down
