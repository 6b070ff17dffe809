"""Every limit at, under and over; nothing gets past them. Numbers by hand from the fixture's."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.cycle.limits import Limit, Limits, limit
from plant_emulator.emulator.plc import reference

# At rates of 100 up and 200 down, 10 ms are worth 1 up and 2 down.
LIMITS = Limits(speed_max=500.0, rate_up=100.0, rate_down=200.0, deviation=40.0, stale=0.1)
ANY = st.floats(allow_nan=True, allow_infinity=True)


def of(wanted, rate=0.0, *, last=100.0, measured=100.0, age=0.0, dt=0.01):
    return limit(wanted, rate, last=last, measured=measured, age=age, dt=dt, limits=LIMITS)


@pytest.mark.parametrize("wanted", [98.0, 99.0, 100.0, 100.5, 101.0])
def test_what_lies_inside_all_limits_passes_unchanged(wanted):
    passed = of(wanted, 50.0)
    assert (passed.speed, passed.rate, passed.by) == (wanted, 50.0, Limit.NONE)


def test_rise_is_held_to_rate_up():
    passed = of(101.5, 50.0)
    assert (passed.speed, passed.rate, passed.by) == (101.0, 0.0, Limit.RATE)


def test_fall_is_held_to_rate_down():
    passed = of(97.5, -50.0)
    assert (passed.speed, passed.rate, passed.by) == (98.0, 0.0, Limit.RATE)


@pytest.mark.parametrize("wanted", [nan, inf, -inf])
def test_what_is_no_number_ramps_towards_standstill(wanted):
    passed = of(wanted, 50.0)
    assert (passed.speed, passed.rate) == (98.0, 0.0)
    assert passed.by == Limit.NOT_FINITE | Limit.RATE


def test_what_is_no_number_ends_at_standstill():
    passed = of(nan, last=1.5, measured=1.0)
    assert (passed.speed, passed.rate, passed.by) == (0.0, 0.0, Limit.NOT_FINITE)


def test_nothing_goes_below_standstill():
    passed = of(-5.0, last=1.0, measured=1.0)
    assert (passed.speed, passed.by) == (0.0, Limit.RATE | Limit.RANGE)


def test_nothing_goes_above_the_maximum():
    passed = of(500.5, last=499.75, measured=499.0)
    assert (passed.speed, passed.by) == (500.0, Limit.RANGE)


@pytest.mark.parametrize("wanted", [0.0, 500.0])
def test_the_ends_of_the_range_belong_to_it(wanted):
    passed = of(wanted, last=wanted, measured=wanted)
    assert (passed.speed, passed.by) == (wanted, Limit.NONE)


def test_setpoint_stays_within_deviation_over_the_measured_speed():
    at = of(100.0, measured=60.0)
    over = of(100.5, measured=60.0)
    assert (at.speed, at.by) == (100.0, Limit.NONE)
    assert (over.speed, over.by) == (100.0, Limit.DEVIATION)


def test_a_stalled_motor_pulls_the_setpoint_down_at_rate_down():
    passed = of(100.0, measured=0.0)
    assert (passed.speed, passed.by) == (98.0, Limit.DEVIATION | Limit.RATE)


@pytest.mark.parametrize("measured", [100.0, 1000.0])
def test_a_measured_speed_never_keeps_the_setpoint_from_falling(measured):
    assert of(0.0, measured=measured).speed == 98.0


@pytest.mark.parametrize("measured", [nan, inf])
def test_a_motor_that_is_not_measured_may_not_speed_up(measured):
    up, down = of(100.5, measured=measured), of(99.0, measured=measured)
    assert (up.speed, up.by) == (100.0, Limit.DEVIATION)
    assert (down.speed, down.by) == (99.0, Limit.NONE)


@pytest.mark.parametrize("age", [0.1001, inf, nan])
def test_stale_data_lets_nothing_rise(age):
    up, level, down = of(100.5, 50.0, age=age), of(100.0, 50.0, age=age), of(99.0, -50.0, age=age)
    assert (up.speed, up.rate, up.by) == (100.0, 0.0, Limit.STALE)
    assert (level.speed, level.rate, level.by) == (100.0, 0.0, Limit.NONE)
    assert (down.speed, down.rate, down.by) == (99.0, -50.0, Limit.NONE)


def test_data_of_exactly_the_stale_age_are_still_fresh():
    passed = of(100.5, 50.0, age=0.1)
    assert (passed.speed, passed.rate, passed.by) == (100.5, 50.0, Limit.NONE)


@pytest.mark.parametrize(("rate", "allowed"), [(100.0, 100.0), (100.5, 100.0), (1.0, 1.0)])
def test_slope_upward_is_held_to_rate_up(rate, allowed):
    assert of(100.0, rate).rate == allowed


@pytest.mark.parametrize(("rate", "allowed"), [(-200.0, -200.0), (-201.0, -200.0), (-1.0, -1.0)])
def test_slope_downward_is_held_to_rate_down(rate, allowed):
    assert of(100.0, rate).rate == allowed


@pytest.mark.parametrize(("rate", "allowed"), [(19.0, 19.0), (20.0, 20.0), (21.0, 20.0)])
def test_slope_ends_within_deviation_over_the_measured_speed(rate, allowed):
    """2 rad/s are left, in the 0.1 s for which the PLC goes on by itself: 20 rad/s^2."""
    assert of(100.0, rate, measured=62.0).rate == pytest.approx(allowed)


@pytest.mark.parametrize(("rate", "allowed"), [(19.0, 19.0), (20.0, 20.0), (21.0, 20.0)])
def test_slope_ends_at_the_maximum(rate, allowed):
    passed = of(498.0, rate, last=498.0, measured=498.0)
    assert (passed.rate, passed.by) == (pytest.approx(allowed), Limit.NONE)


def test_slope_downward_is_free_at_every_ceiling():
    assert of(500.0, -150.0, last=500.0, measured=460.0).rate == -150.0


def test_slope_is_followed_for_as_long_as_the_plc_does():
    """The motor turns at 62 rad/s, so that the setpoint may end 40 rad/s above, at 102 rad/s."""
    passed = of(100.0, 25.0, measured=62.0)
    target = reference.Target(speed=passed.speed, slope=passed.rate, slew=inf, age=0.0)
    assert target.at(0.05) < target.at(10.0) == pytest.approx(102.0)


@pytest.mark.parametrize("rate", [nan, inf, -inf])
def test_slope_that_is_no_number_is_none(rate):
    assert of(100.0, rate).rate == 0.0


@pytest.mark.parametrize("dt", [5.0, inf])
def test_a_gap_in_time_earns_no_more_than_the_stale_time(dt):
    assert of(130.0, dt=dt).speed == 110.0


@pytest.mark.parametrize("dt", [0.0, -1.0, nan])
def test_a_time_that_is_no_time_earns_nothing(dt):
    assert of(130.0, dt=dt).speed == 100.0
    assert of(0.0, dt=dt).speed == 100.0


@given(ANY, ANY, ANY, ANY, ANY, st.floats(0.0, 500.0))
def test_no_input_gets_past_the_limits(wanted, rate, measured, age, dt, last):
    passed = of(wanted, rate, last=last, measured=measured, age=age, dt=dt)
    assert 0.0 <= passed.speed <= 500.0
    assert last - 20.0 <= passed.speed <= last + 10.0
    assert -200.0 <= passed.rate <= 100.0
    assert passed.speed <= last or age <= 0.1
    assert passed.speed <= last or passed.speed <= measured + 40.0
    if passed.rate > 0.0:
        assert passed.speed + passed.rate * 0.1 <= min(measured + 40.0, 500.0) + 1e-9
