"""Steady stretches and their friction: independent logs, Table 3.1, numbers by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gateway.configuration.sections import BenchConfig, RegulatorConfig
from gateway.errors import ConfigError
from gateway.losses.sections import LossesError, SweepTrace, steady
from gateway.recordings.steady_runs import _mean_torque, read

DATA = Path(__file__).parents[2] / "data"
BENCH = BenchConfig()


def table_3_1(omega: float) -> float:
    """Friction at the gear output [N m], thesis eq 3.27."""
    return 35.989 + 345.38 * omega**0.4418


def trace(motor_speed, shaft_torque, *, seconds=10.0):
    """A run at 100 Hz under functions of time; the drum turns with the gear."""
    time = np.arange(0.0, seconds, 0.01)
    speed = np.broadcast_to(motor_speed(time), time.shape).astype(float)
    torque = np.broadcast_to(shaft_torque(time), time.shape).astype(float)
    return SweepTrace(
        name="run", time=time, motor_speed=speed, drum_speed=speed / 62.6, shaft_torque=torque
    )


def test_an_independent_log_shows_the_friction_of_the_thesis_at_each_of_its_speeds():
    found = steady(read(DATA / "bench_nominal" / "program2.csv.gz").trace, BENCH)
    # the corners of program 2
    speeds = [120.0, 170.0, 240.0, 275.0, 375.0]
    assert [one.motor_speed for one in found.sections] == pytest.approx(speeds, rel=2e-3)
    for one in found.sections:
        assert one.gear_speed == pytest.approx(one.motor_speed / 62.6)
        assert one.friction == pytest.approx(table_3_1(one.gear_speed), rel=1e-4)


def test_noise_of_the_sensors_keeps_the_friction_within_three_standard_errors():
    for program in ("program1", "program2", "program3"):
        log = read(DATA / "bench_practice" / "practice_004" / f"{program}.csv.gz")
        for one in steady(log.trace, BENCH).sections:
            error = one.friction - table_3_1(one.gear_speed)
            assert abs(error) < 3.0 * one.standard_error
            assert one.standard_error < 2.0


def test_what_the_inertia_takes_in_a_slow_change_is_no_friction():
    """0.1 rad/s^2 of the motor: 312.71242 x 0.1 / 62.6 = 0.49954 N m at the gear output."""
    friction = 600.0
    torque = -(friction + 312.71242 * 0.1 / 62.6) / 62.6
    (one,) = steady(trace(lambda t: 200.0 + 0.1 * t, lambda t: torque), BENCH).sections
    assert one.friction == pytest.approx(friction, abs=1e-6)


def test_the_configured_zero_of_the_sensor_is_taken_off():
    (one,) = steady(
        trace(lambda t: 200.0, lambda t: -9.5), BENCH, RegulatorConfig(torque_offset=0.5)
    ).sections
    assert one.friction == pytest.approx(626.0)


def test_a_torque_of_the_wrong_sign_is_refused_by_name():
    log = read(DATA / "bench_nominal" / "program2.csv.gz").trace
    with pytest.raises(LossesError, match=r"sign of the shaft torque.*\+12\.\d\d N m.*5 of 5"):
        steady(replace(log, shaft_torque=-log.shaft_torque), BENCH)


def test_a_truck_on_the_drum_is_refused_by_name():
    with pytest.raises(ConfigError, match=r"wheel_torque_Nm: a truck stands on the drum"):
        read(DATA / "bench_nominal" / "program6.csv.gz")


@pytest.mark.parametrize(
    ("motor_speed", "shaft_torque", "why"),
    [
        (lambda t: -200.0, lambda t: 9.0, "turns backwards"),
        (lambda t: 40.0 + 0.4 * t, lambda t: -5.0, "speed drifts by 8"),
        (lambda t: 200.0, lambda t: -9.0 - 0.3 * t, "torque is not steady"),
        (lambda t: np.maximum(200.0, 200.0 + 50.0 * (t - 1.9)), lambda t: -9.0, "only 0.97 s"),
    ],
)
def test_a_stretch_that_cannot_be_used_is_left_out_with_its_reason(motor_speed, shaft_torque, why):
    found = steady(trace(motor_speed, shaft_torque), BENCH)
    assert found.sections == ()
    (out,) = found.left_out
    assert why in out.why


def test_a_drum_that_does_not_turn_with_the_gear_is_left_out_by_name():
    run = trace(lambda t: 200.0, lambda t: -9.0)
    (out,) = steady(replace(run, drum_speed=0.5 * run.drum_speed), BENCH).left_out
    assert "gear 3.195 rad/s and drum 1.597 rad/s do not belong together" in out.why


def test_a_log_that_is_sampled_too_coarsely_is_refused_by_name():
    run = trace(lambda t: 200.0, lambda t: -9.0)
    names = ("time", "motor_speed", "drum_speed", "shaft_torque")
    coarse = replace(run, **{name: getattr(run, name)[::40] for name in names})
    with pytest.raises(LossesError, match=r"a sample every 0\.4 s; expected one every 0\.25 s"):
        steady(coarse, BENCH)


@pytest.mark.parametrize("every", [2, 5, 20])
def test_other_sample_rates_show_the_same_friction(every):
    log = read(DATA / "bench_nominal" / "program2.csv.gz").trace
    names = ("time", "motor_speed", "drum_speed", "shaft_torque")
    thinned = replace(log, **{name: getattr(log, name)[::every] for name in names})
    found = steady(thinned, BENCH).sections
    assert len(found) == 5
    for one in found:
        assert one.friction == pytest.approx(table_3_1(one.gear_speed), rel=1e-3)


def test_ramps_and_standstill_are_no_stretches():
    found = steady(trace(lambda t: np.maximum(0.0, 20.0 * (t - 5.0)), lambda t: -9.0), BENCH)
    assert found.sections == found.left_out == ()


def test_a_gap_in_the_log_joins_no_stretches():
    whole = trace(lambda t: 200.0, lambda t: -9.0)
    kept = (whole.time < 4.0) | (whole.time > 7.0)
    names = ("time", "motor_speed", "drum_speed", "shaft_torque")
    broken = replace(whole, **{name: getattr(whole, name)[kept] for name in names})
    found = [(one.start, one.end) for one in steady(broken, BENCH).sections]
    assert found == [pytest.approx((0.5, 3.5), abs=0.05), pytest.approx((7.5, 9.5), abs=0.05)]


def test_mean_torque_comes_from_the_integral_across_its_wrap():
    """An int32 of 0.0001 N m s wraps after 429496.7296 N m s; -12 N m for 0.02 s is -0.24."""
    rows = np.zeros(3, [("measured_shaft_torque", "f8"), ("measured_shaft_torque_integral", "f8")])
    rows["measured_shaft_torque"] = [-11.0, -99.0, -99.0]
    rows["measured_shaft_torque_integral"] = [-214748.2, 214748.2896, 214748.0496]
    mean = _mean_torque(rows, np.array([0.0, 0.02, 0.04]), 429496.7296)
    assert mean == pytest.approx([-11.0, -12.0, -12.0], abs=1e-6)


@pytest.mark.parametrize("name", ["none.csv", "."])
def test_a_file_that_cannot_be_read_is_named(name, tmp_path):
    with pytest.raises(ConfigError, match="expected a log or a recording"):
        read(tmp_path / name)
