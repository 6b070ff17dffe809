"""Effects of the drive against calculations by hand."""

from collections.abc import Mapping
from math import sqrt
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.signal import lsim

from plant_emulator import effects
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log
from plant_emulator.simulation.simulate import values_of
from tests import reference_plant as thesis
from tests.plant_emulator.runs import INT_SPEED, Piecewise, linear, simulate

COMPARED = ("motor_speed", "drum_speed", "armature_current", "shaft_torque")


def effect(nominal: ParameterSet, name: str, **values: float) -> Mapping[str, float]:
    return values_of(nominal, {name: values})


# --- reference ----------------------------------------------------------------------------------


def test_ramp_limit_lets_the_motor_reach_full_speed_in_the_ramp_time(nominal: ParameterSet) -> None:
    """505.8 rad/s in 8 s: a step of the reference becomes a slope of 63.2 rad/s^2, both ways."""
    steps = linear((0.2, 0.0), (0.21, 200.0), (5.0, 200.0), (5.01, 0.0), duration=9.0)
    log = simulate(steps, effect(nominal, "reference_ramp_limit", ramp_time=8.0))
    for begin, sign in ((1.0, 1.0), (6.0, -1.0)):
        span = (log.time >= begin) & (log.time <= begin + 1.5)
        slope = np.polyfit(log.time[span], log["motor_speed"][span], 1)[0]
        assert slope == pytest.approx(sign * 505.796417 / 8.0, rel=3e-3)


def test_ramp_lands_as_far_below_the_reference_as_its_slope_and_landing_time(
    nominal: ParameterSet,
) -> None:
    """By hand, at 63.2 rad/s^2 and 0.1 s: straight up to 6.32 rad/s below 60 rad/s, then slower."""
    slope, landing = 505.796417 / 8.0, 0.1
    step = linear((0.2, 0.0), (0.2005, 60.0), duration=2.0, period=5e-4)
    straight = (60.0 - slope * landing) / slope
    after = np.maximum(0.0, step.time - 0.2)
    lands = 60.0 - slope * landing * np.exp(-np.maximum(0.0, after - straight) / landing)
    by_hand = np.where(after < straight, slope * after, lands)
    expected = simulate(Log(step.time, {"speed_reference": by_hand}, "hand"), nominal.values())
    values = effect(nominal, "reference_ramp_limit", ramp_time=8.0, landing_time=landing)
    found = simulate(step, values)
    assert np.abs(found["motor_speed"] - expected["motor_speed"]).max() < 0.05
    corner = simulate(step, effect(nominal, "reference_ramp_limit", ramp_time=8.0))
    assert np.abs(corner["motor_speed"] - expected["motor_speed"]).max() > 1.0


def test_ramp_that_is_slow_enough_passes_the_limit(nominal: ParameterSet) -> None:
    slow = linear((0.2, 0.0), (3.2, 150.0), (4.0, 150.0), duration=5.0)
    plain = simulate(slow, nominal.values())
    log = simulate(slow, effect(nominal, "reference_ramp_limit", ramp_time=8.0))
    for name in COMPARED:
        np.testing.assert_allclose(log[name], plain[name], atol=1e-3)


@pytest.mark.parametrize(("time_constant", "damping"), [(0.04, 0.7), (0.02, 1.0), (0.002, 10.0)])
def test_filter_is_one_of_second_order_on_the_reference(
    nominal: ParameterSet, time_constant: float, damping: float
) -> None:
    """Run whose reference scipy filtered beforehand."""
    inputs = linear((0.2, 0.0), (0.8, 100.0), (1.2, 100.0), (1.6, 40.0), duration=2.0, period=1e-3)
    system = ([1.0], [time_constant**2, 2.0 * damping * time_constant, 1.0])
    _, filtered, _ = lsim(system, inputs["speed_reference"], inputs.time)
    beforehand = Log(inputs.time, {"speed_reference": filtered}, "filtered")
    expected = simulate(beforehand, nominal.values())
    values = effect(nominal, "reference_filter", time_constant=time_constant, damping=damping)
    found = simulate(inputs, values)
    assert np.abs(found["motor_speed"] - expected["motor_speed"]).max() < 0.03
    unfiltered = simulate(inputs, nominal.values())
    assert np.abs(found["motor_speed"] - unfiltered["motor_speed"]).max() > 3.0


def test_filter_and_ramp_limit_act_one_after_the_other(nominal: ParameterSet) -> None:
    """A limited ramp, filtered, lags behind it by 2 zeta T."""
    step = linear((0.2, 0.0), (0.21, 200.0), duration=2.5)
    ramp = {"reference_ramp_limit": {"ramp_time": 5.0}}
    both = {**ramp, "reference_filter": {"time_constant": 0.05, "damping": 0.7}}
    limited = simulate(step, values_of(nominal, ramp))["motor_speed"][-1]
    filtered = simulate(step, values_of(nominal, both))["motor_speed"]
    assert filtered.max() <= 200.5
    assert limited == pytest.approx(200.0, abs=0.5)
    assert filtered.min() >= -0.5


def test_jitter_is_spread_evenly_around_the_dead_time_and_stays_within_a_scan() -> None:
    """The standard deviation of an even spread over +-A is A / sqrt(3)."""
    dead_time = effects.load("delay_jitter").laws["dead_time"]
    p = SimpleNamespace(
        delay_jitter_amplitude=0.004, delay_jitter_scan_period=0.01, delay_jitter_sequence=3.0
    )
    start, end = (
        np.array([dead_time(0.06, SimpleNamespace(time=t), p) for t in 0.01 * np.arange(4000) + dt])
        for dt in (0.0, 0.0099)
    )
    np.testing.assert_array_equal(start, end)
    assert np.abs(start - 0.06).max() <= 0.004
    assert start.mean() == pytest.approx(0.06, abs=2e-4)
    assert start.std() == pytest.approx(0.004 / sqrt(3.0), rel=0.03)
    neighbours = np.corrcoef(start[1:], start[:-1])[0, 1]
    assert abs(neighbours) < 0.05


def test_jitter_shows_as_slope_times_amplitude(nominal: ParameterSet) -> None:
    """On a ramp of 100 rad/s^2 a dead time off by A is a reference off by 100 A, times 15 A s/rad.

    The current follows within a scan; it is sampled at the scan's end.
    """
    ramp = linear((0.2, 0.0), (2.2, 200.0), duration=2.2)
    plain = simulate(ramp, nominal.values())
    log = simulate(ramp, effect(nominal, "delay_jitter", amplitude=0.005))
    steady = log.time > 1.5
    change = (log["armature_current"] - plain["armature_current"])[steady]
    assert 0.2 < np.abs(change).max() / (100.0 * 0.005 * 15.0) < 1.3


# --- limits -------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_current_is_limited_to_what_is_left_of_72_ampere(
    nominal: ParameterSet, direction: float
) -> None:
    step = linear((0.2, 0.0), (0.3, direction * 150.0), duration=2.0)
    log = simulate(step, effect(nominal, "current_limit", reduction=51.0))
    current = direction * log["armature_current"]
    assert 20.5 < current.max() <= 21.0
    plain = direction * simulate(step, nominal.values())["armature_current"]
    assert plain.max() > 60.0


@pytest.mark.parametrize(
    ("wanted", "current"),
    [(15.9, 15.9), (16.0, 16.0), (18.0, 17.75), (-20.0, 19.0), (22.0, 19.75), (24.0, 20.0)],
)
def test_rounded_limit_is_a_parabola_between_two_lines(wanted: float, current: float) -> None:
    """Limit 20 A, rounding 0.2: the line up to 16 A, 20 A from 24 A on; (i - 16)^2 / 16 less."""
    p = SimpleNamespace(current_limit_reduction=52.0, current_limit_rounding=0.2)
    law = effects.load("current_limit").laws["current_limit"]
    limit = law(72.0, SimpleNamespace(wanted_current=wanted), p)
    assert min(abs(wanted), limit) == pytest.approx(current)


def test_rounding_vanishes_with_the_reduction() -> None:
    """A limit that is hardly reduced has the nominal corner, whatever its rounding."""
    law = effects.load("current_limit").laws["current_limit"]
    p = SimpleNamespace(current_limit_reduction=0.01, current_limit_rounding=0.5)
    limits = [law(72.0, SimpleNamespace(wanted_current=i), p) for i in (60.0, 72.0, 90.0)]
    assert limits == pytest.approx([72.0] * 3, abs=0.02)


def test_rounded_limit_needs_no_shorter_steps(nominal: ParameterSet) -> None:
    step = linear((0.2, 0.0), (0.3, 150.0), duration=2.0)
    values = effect(nominal, "current_limit", reduction=51.0, rounding=0.2)
    found = simulate(step, values)["armature_current"]
    fine = simulate(step, values, largest_step=2e-4)["armature_current"]
    np.testing.assert_allclose(found, fine, atol=0.02)
    sharp = simulate(step, effect(nominal, "current_limit", reduction=51.0))["armature_current"]
    assert np.max(sharp - found) > 0.5


def test_sagging_voltage_sets_the_top_speed(nominal: ParameterSet) -> None:
    """400 - R_s i = R_a i + k Phi omega with k Phi i = T_f / xi, the drum floating in its gap."""
    source = 3.0

    def left(omega: float) -> float:
        flux = thesis.k_phi(omega)
        current = thesis.friction(omega / thesis.xi, sign=np.sign) / thesis.xi / flux
        return float(400.0 - (source + thesis.R_a) * current - flux * omega)

    inputs = linear((0.2, 0.0), (8.0, 500.0), duration=120.0, period=0.05)
    log = simulate(inputs, effect(nominal, "voltage_sag", source_resistance=source))
    assert log["motor_speed"][-100:].mean() == pytest.approx(brentq(left, 50.0, 500.0), rel=3e-3)
    assert log["motor_speed"][-1] < 450.0


def test_sag_that_grows_with_the_square_of_the_current(nominal: ParameterSet) -> None:
    """|u| <= 400 - R_s i_max (i / i_max)^2, i_max being 72 A."""
    inputs = linear((0.2, 0.0), (0.25, 400.0), (3.0, 400.0), duration=3.0, period=0.001)
    log = simulate(inputs, effect(nominal, "voltage_sag", source_resistance=2.0, exponent=2.0))
    sag = 2.0 * 72.0 * (log["armature_current"] / 72.0) ** 2
    room = 400.0 - sag - np.abs(log["armature_voltage"])
    assert room.min() > -0.2
    assert np.count_nonzero(room < 0.2) > 500


def test_voltage_limit_follows_the_current_through_the_lag_of_the_supply(
    nominal: ParameterSet,
) -> None:
    """|u| <= 400 - U_s, U_s being 2 |i| through a lag of 0.1 s; the current is the log's own."""
    inputs = linear((0.2, 0.0), (0.25, 400.0), (3.0, 400.0), duration=3.0, period=0.001)
    lagging = effect(nominal, "voltage_sag", source_resistance=2.0, time_constant=0.1)
    log = simulate(inputs, lagging)
    sag = lsim(([2.0], [0.1, 1.0]), np.abs(log["armature_current"]), log.time - log.time[0])[1]
    room = 400.0 - sag - np.abs(log["armature_voltage"])
    assert room.min() > -0.2
    assert np.count_nonzero(room < 0.2) > 500


def test_wound_up_integrator_holds_the_whole_integral_of_the_error(nominal: ParameterSet) -> None:
    """With conditional integration it holds less, since it waited while the current was limited."""
    held, whole = {}, {}
    for share in (0.0, 1.0):
        bench = Piecewise(effect(nominal, "integrator_windup", share=share))
        parts = [bench.to(0.01, 200.0, pieces=10), bench.to(2.0, 200.0, pieces=1990)]
        speed = np.concatenate([parts[0][:, 0], parts[1][1:, 0]])
        reference = np.concatenate([np.linspace(0.0, 200.0, 11), np.full(1990, 200.0)])
        held[share] = bench.x[INT_SPEED]
        whole[share] = float(np.trapezoid(reference - speed, dx=1e-3))
    assert held[1.0] == pytest.approx(whole[1.0], rel=1e-3)
    assert held[0.0] < 0.7 * whole[0.0]


# --- converter ----------------------------------------------------------------------------------


def test_current_pauses_when_it_changes_sign(nominal: ParameterSet) -> None:
    """Without the effect the current crosses zero at once."""
    inputs = linear((0.1, 0.0), (1.0, 100.0), (1.2, 100.0), (2.0, 0.0), duration=1.8, period=1e-3)
    braking = slice(1250, 1800)
    for pause in (0.0, 0.02, 0.05):
        log = simulate(inputs, effect(nominal, "converter_dead_time", pause=pause))
        current = log["armature_current"][braking]
        assert current.min() < -5.0
        still = np.count_nonzero(np.abs(current) < 0.05) * 1e-3
        assert still == pytest.approx(pause, abs=0.003)


def test_converter_drop_is_made_up_by_the_demanded_voltage(nominal: ParameterSet) -> None:
    """Steady: u = R_a i + k Phi omega + U i / (|i| + i_g)."""
    inputs = linear((0.2, 0.0), (3.0, 150.0), duration=12.0)
    log = simulate(
        inputs, effect(nominal, "converter_dead_time", drop=8.0, discontinuous_below=3.0)
    )
    current, speed = log["armature_current"][-1], log["motor_speed"][-1]
    expected = 0.424 * current + 1.8506 * speed + 8.0 * current / (current + 3.0)
    assert log["armature_voltage"][-1] == pytest.approx(expected, rel=1e-4)


def test_ripple_of_six_pulses_alternates_when_sampled_at_600_hertz(nominal: ParameterSet) -> None:
    inputs = linear((0.2, 0.0), (2.0, 150.0), duration=3.0, period=1.0 / 600.0)
    plain = simulate(inputs, nominal.values())
    values = effect(nominal, "converter_dead_time", ripple=0.8, discontinuous_below=2.0)
    log = simulate(inputs, values)
    ripple = (log["armature_current"] - plain["armature_current"])[-100:]
    current = plain["armature_current"][-100:]
    sign = np.where(np.arange(len(log.time))[-100:] % 2 == 0, 1.0, -1.0)
    np.testing.assert_allclose(ripple, sign * 0.8 * current / (current + 2.0), atol=1e-6)
    np.testing.assert_array_equal(log["motor_speed"], plain["motor_speed"])


def test_ripple_of_mains_off_50_hertz_beats_in_a_log_of_100_hertz(nominal: ParameterSet) -> None:
    """By hand: 6 x 50.02 Hz sampled at 100 Hz is 0.12 Hz."""
    inputs = linear((0.2, 0.0), (2.0, 150.0), duration=12.0, period=0.01)
    plain = simulate(inputs, nominal.values())
    sizes = {"ripple": 0.8, "discontinuous_below": 2.0, "mains": 50.02, "phase": 0.3}
    log = simulate(inputs, effect(nominal, "converter_dead_time", **sizes))
    ripple = (log["armature_current"] - plain["armature_current"])[-800:]
    current = plain["armature_current"][-800:]
    wave = np.cos(2.0 * np.pi * 0.12 * log.time[-800:] + 0.3)
    np.testing.assert_allclose(ripple, wave * 0.8 * current / (current + 2.0), atol=1e-6)
