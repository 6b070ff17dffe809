"""Holes of a log: rows come in that do not count, and the reference keeps its corner."""

from __future__ import annotations

import numpy as np
import pytest

from plant_emulator.recordings.holes import bridge_holes
from plant_emulator.signals.log import Log

TIME = np.arange(0.0, 10.0, 0.01)


def reference(time: np.ndarray) -> np.ndarray:
    """Up at 50 rad/s^2 until 4 s, then steady."""
    return np.minimum(50.0 * time, 200.0)


def holed(first: float, last: float) -> Log:
    kept = (first >= TIME) | (last <= TIME)
    time = TIME[kept]
    return Log(time, {"speed_reference": reference(time), "motor_speed": reference(time)})


def bridged(first: float, last: float) -> tuple[Log, np.ndarray]:
    log = holed(first, last)
    found, use = bridge_holes(log, {"motor_speed": np.ones(len(log.time), bool)})
    return found, use["motor_speed"]


def test_hole_over_a_corner_gets_the_corner_back() -> None:
    log, use = bridged(3.7, 4.2)
    assert log.time == pytest.approx(TIME)
    assert log["speed_reference"] == pytest.approx(reference(TIME), abs=1e-6)
    assert log.time[~use] == pytest.approx(np.arange(3.71, 4.195, 0.01))


def test_lost_row_of_a_corner_comes_back() -> None:
    log, use = bridged(3.99, 4.01)
    assert log["speed_reference"] == pytest.approx(reference(TIME), abs=1e-6)
    assert log.time[~use] == pytest.approx([4.0])


@pytest.mark.parametrize("rows", [1, 2, 5, 15])
def test_lost_rows_of_a_curve_come_back(rows: int) -> None:
    """20 sin(3 t): a cubic spline over h is off by at most 5 / 384 * 20 * 3^4 * h^4.

    C. A. Hall, W. W. Meyer, J. Approx. Theory 16 (1976) 105. The chord is off by 20 * 3^2 h^2 / 8:
    the log tells an error between the two.
    """
    time = np.delete(TIME, [k + j for k in (50, 300, 755) for j in range(rows)])
    log, _ = bridge_holes(Log(time, {"speed_reference": 20.0 * np.sin(3.0 * time)}), {})
    assert log.time == pytest.approx(TIME)
    off = np.abs(log["speed_reference"] - 20.0 * np.sin(3.0 * TIME)).max()
    length = 0.01 * (rows + 1)
    assert off < 5.0 / 384.0 * 20.0 * 81.0 * length**4
    assert 0.5 * off < log["speed_reference_error"].max() < 0.1 * 20.0 * 9.0 * length**2 / 8.0


def test_corner_between_noisy_sides_comes_back() -> None:
    """Ramps of 200 N m/s and of -100 N m/s meet at 4 s; noise of 0.05 N m is no curve."""
    torque = np.minimum(200.0 * (TIME - 4.0), -100.0 * (TIME - 4.0))
    noisy = torque + 0.05 * np.random.default_rng(5).standard_normal(len(TIME))
    kept = (TIME <= 3.9) | (TIME >= 4.1)
    log, _ = bridge_holes(Log(TIME[kept], {"wheel_torque": noisy[kept]}), {})
    off = np.abs(log["wheel_torque"] - torque).max()
    assert off < 1.0  # the chord is off by 13 N m
    assert off < 2.0 * log["wheel_torque_error"].max()


def test_jittered_log_that_lost_no_row_stays() -> None:
    random = np.random.default_rng(1)
    time = TIME + random.uniform(-0.0035, 0.0035, len(TIME))
    log = Log(time, {"speed_reference": reference(time)})
    assert bridge_holes(log, {})[0] is log


def test_hole_in_a_straight_stretch_stays_straight() -> None:
    log, _ = bridged(6.0, 6.5)
    assert log["speed_reference"] == pytest.approx(reference(TIME))


@pytest.mark.parametrize(("first", "last"), [(3.7, 4.2), (6.0, 6.5), (1.0, 1.5), (3.99, 4.01)])
def test_hole_that_lines_bridge_hides_nothing(first: float, last: float) -> None:
    log, _ = bridged(first, last)
    assert not log["speed_reference_error"].any()


def test_input_that_moved_in_a_hole_is_uncertain_by_half_of_that() -> None:
    """It went from 0 to 6 at its end or at its start: a straight one is off by 3 in the mean."""
    kept = (TIME <= 3.7) | (TIME >= 4.2)
    torque = np.where(TIME < 4.0, 0.0, 6.0)
    signals = {"speed_reference": reference(TIME)[kept], "wheel_torque": torque[kept]}
    log, _ = bridge_holes(Log(TIME[kept], signals), {})
    within = (log.time > 3.705) & (log.time < 4.195)
    assert log["wheel_torque_error"][within] == pytest.approx(3.0)
    assert not log["wheel_torque_error"][~within].any()


def test_curve_in_a_long_hole_is_as_uncertain_as_what_its_sides_miss() -> None:
    """20 sin(3 t) turns at 0.524 s, in a hole of 0.5 s. Its fourth derivative there is 1620."""
    kept = (TIME <= 0.28) | (TIME >= 0.78)
    curve = 20.0 * np.sin(3.0 * TIME)
    log, _ = bridge_holes(Log(TIME[kept], {"speed_reference": curve[kept]}), {})
    off = np.abs(log["speed_reference"] - curve).max()
    assert off < 5.0 / 384.0 * 1620.0 * 0.5**4
    assert off < log["speed_reference_error"].max() < 0.5 * 5.2  # the chord is off by 5.2


@pytest.mark.parametrize("length", [0.16, 0.5])
def test_jump_between_curves_is_uncertain_by_half_of_it(length: float) -> None:
    kept = (TIME <= 5.0) | (5.0 + length <= TIME)
    curve = 20.0 * np.sin(TIME) + np.where(5.0 + 0.5 * length > TIME, 0.0, 10.0)
    log, _ = bridge_holes(Log(TIME[kept], {"speed_reference": curve[kept]}), {})
    assert log["speed_reference_error"].max() == pytest.approx(5.0, rel=0.3)


@pytest.mark.parametrize("step", [0.05, 0.1])
def test_rounded_curve_is_not_known_exactly(step: float) -> None:
    """20 sin(3 t), rounded: the input cannot be told better than some tenths of a step."""
    kept = (TIME <= 1.55) | (TIME >= 1.71)
    curve = 20.0 * np.sin(3.0 * TIME)
    rounded = step * np.round(curve / step)
    log, _ = bridge_holes(Log(TIME[kept], {"speed_reference": rounded[kept]}), {})
    off = np.abs(log["speed_reference"] - curve).max()
    assert off < 4.0 * log["speed_reference_error"].max()


def test_few_noisy_samples_are_no_curve() -> None:
    noise = np.random.default_rng(4).standard_normal(8)
    time = np.concatenate([np.arange(4), 10 + np.arange(4)]) * 0.01
    log, _ = bridge_holes(Log(time, {"wheel_torque": noise}), {})
    assert np.abs(log["wheel_torque"]).max() < 5.0


def test_noise_of_an_input_is_no_move() -> None:
    torque = 70.0 + np.random.default_rng(3).standard_normal(len(TIME))
    kept = np.ones(len(TIME), bool)
    kept[50::97] = False
    signals = {"speed_reference": reference(TIME)[kept], "wheel_torque": torque[kept]}
    log, _ = bridge_holes(Log(TIME[kept], signals), {})
    assert np.all(np.abs(log["wheel_torque_error"]) < 1.5)


def test_wheel_torque_gets_its_corner_back() -> None:
    torque = np.minimum(0.0, -1000.0 * (TIME - 4.0))
    kept = (TIME <= 3.7) | (TIME >= 4.2)
    signals = {"speed_reference": reference(TIME)[kept], "wheel_torque": torque[kept]}
    log, _ = bridge_holes(Log(TIME[kept], signals), {})
    assert log["wheel_torque"] == pytest.approx(torque, abs=1e-6)


def test_rows_that_are_there_stay_as_they_are() -> None:
    log, use = bridged(3.7, 4.2)
    whole = holed(3.7, 4.2)
    assert np.array_equal(log.time[use], whole.time)
    assert np.array_equal(log["motor_speed"][use], whole["motor_speed"])


def test_log_without_a_hole_stays() -> None:
    log = Log(TIME, {"speed_reference": reference(TIME)})
    assert bridge_holes(log, {})[0] is log


def test_rows_of_a_hole_have_none_of_the_knees_beside_it() -> None:
    """A log with knees tells its corners itself, but in a hole of 0.5 s nobody knows them."""
    log = holed(3.7, 4.2)
    knees = [f"reference_knee{number}_time" for number in ("", "_2", "_3")]
    signals = {**log.signals, **{name: np.full(len(log.time), 0.004) for name in knees}}
    log = Log(log.time, signals)
    found, use = bridge_holes(log, {"motor_speed": np.ones(len(log.time), bool)})
    rows = use["motor_speed"]
    for name in knees:
        assert found[name][rows] == pytest.approx(0.004)
        assert found[name][~rows] == pytest.approx(0.0)
