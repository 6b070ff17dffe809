"""Stamps corrected by the reference: what was done to them is what is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.recordings.recording import recording
from plant_emulator.recordings.stamps import lateness, restamp, restamp_all
from plant_emulator.signals.log import KNEE_TIME, TIMING_ERROR, TRUCK, Log

RATE = 75.0


def reference(time: np.ndarray) -> np.ndarray:
    """Up at 75 rad/s^2 to 300 rad/s, steady, and down again."""
    return np.interp(time, [0.0, 1.0, 5.0, 10.0, 14.0, 15.0], [0.0, 0.0, 300.0, 300.0, 0.0, 0.0])


def log(time: np.ndarray, taken: np.ndarray, **more: np.ndarray) -> Log:
    return Log(time, {"speed_reference": reference(taken), "motor_speed": taken, **more})


def test_rows_off_their_stamps_get_the_times_they_were_taken_at() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    off = np.random.default_rng(1).uniform(-2e-3, 2e-3, len(time))
    found, jitter = restamp(log(time, time + off))
    ramp = np.abs(np.gradient(reference(time), time)) > 50.0
    assert jitter == pytest.approx(2e-3 / np.sqrt(3.0), rel=0.1)
    error = (found.time - time - off)[ramp]
    assert np.sqrt(np.mean(error**2)) < 0.3 * 2e-3 / np.sqrt(3.0)
    steady = (time > 5.5) & (time < 9.5)
    assert np.array_equal(found.time[steady], time[steady])
    uncertain = found[TIMING_ERROR]
    assert np.mean((error / uncertain[ramp]) ** 2) == pytest.approx(1.0, abs=0.25)
    assert uncertain[steady] == pytest.approx(jitter)


def test_an_uncertain_time_is_noise_in_proportion_to_the_rate_of_change() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    random = np.random.default_rng(1)
    step = np.where(time < 7.0, 0.0, 20.0)
    torque = step + random.normal(0.0, 0.25, len(time))
    given = log(time, time + random.uniform(-2e-3, 2e-3, len(time)), shaft_torque=torque)
    found, jitter = restamp(given)
    ratio = recording(found).noise_ratio[1]
    at_step = np.flatnonzero(np.diff(step))[0]
    beside = 20.0 / 0.01 * jitter / 0.25
    assert ratio[at_step : at_step + 2] == pytest.approx([beside, beside], rel=0.15)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.05)
    assert np.all(recording(given).noise_ratio == 1.0)


def test_neither_a_spike_nor_a_held_channel_makes_noise_of_a_rows_time() -> None:
    """By hand: torque at 63 N m/s off by 1.2 ms is 0.07 N m, where its noise is 0.25 N m."""
    time = np.arange(0.0, 15.0, 0.01)
    random = np.random.default_rng(1)
    torque = 20.0 * np.sin(np.pi * time) + random.normal(0.0, 0.25, len(time))
    late = random.uniform(-2e-3, 2e-3, len(time))
    spiked = torque.copy()
    spiked[700] += 25.0
    found, _ = restamp(log(time, time + late, shaft_torque=spiked))
    assert recording(found).noise_ratio[1, 699:702] == pytest.approx(1.0, abs=0.25)
    fresh = np.arange(len(time)) // 10 * 10
    found, _ = restamp(log(time, time + late, shaft_torque=torque[fresh]))
    own = recording(found)
    own.noise[1] = 0.25
    counted = replace(own, use=own.use & (fresh == np.arange(len(time))))
    assert np.median(counted.noise_ratio[1, ::10]) == pytest.approx(1.03, abs=0.05)


def test_rows_on_their_stamps_stay() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    given = log(time, time)
    found, jitter = restamp(given)
    assert jitter == 0.0
    assert found is given


def test_a_staircase_tells_nothing() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    given = log(time, time + 1e-3 * np.sin(time), wheel_torque=np.zeros(len(time)))
    assert restamp(given) == (given, None)
    assert restamp_all([given]) == [(given, 0.0)]


def test_a_log_with_a_truck_has_the_jitter_of_the_other_logs() -> None:
    """A reference that was read between two steps is that of its stamps; all else is uncertain."""
    time = np.arange(0.0, 15.0, 0.01)
    random = np.random.default_rng(1)
    off, other = random.uniform(-2e-3, 2e-3, (2, len(time)))
    truck = log(time, time + off, wheel_torque=np.zeros(len(time)))
    (_, told), (found, jitter) = restamp_all([log(time, time + other), truck])
    assert jitter == told
    assert jitter == pytest.approx(2e-3 / np.sqrt(3.0), rel=0.1)
    assert found[TIMING_ERROR] == pytest.approx(jitter)
    assert np.array_equal(found.time, time)
    ramp = np.abs(np.gradient(reference(time), time)) > 50.0
    before, after = (
        np.sqrt(np.mean((one["speed_reference"] - reference(time))[ramp] ** 2))
        for one in (truck, found)
    )
    assert before == pytest.approx(RATE * jitter, rel=0.1)
    assert after < 0.3 * before


@pytest.mark.parametrize(("half_width", "noise"), [(2e-3, 0.2), (2e-3, 0.5), (3e-3, 0.3)])
def test_a_reference_that_noise_moves_stays(half_width: float, noise: float) -> None:
    """A jitter of 1.2 ms moves a slope of 75 rad/s^2 by 0.09 rad/s, one of 1.7 ms by 0.13."""
    time = np.arange(0.0, 15.0, 0.01)
    random = np.random.default_rng(1)
    other = random.uniform(-half_width, half_width, len(time))
    truck = log(time, time, wheel_torque=np.zeros(len(time)))
    truck.signals["speed_reference"] += random.normal(0.0, noise, len(time))
    (_, jitter), (found, _) = restamp_all([log(time, time + other), truck])
    assert np.array_equal(found["speed_reference"], truck["speed_reference"])
    assert found[TIMING_ERROR] == pytest.approx(jitter)


def test_neither_held_out_logs_nor_stamps_of_the_plc_tell_a_jitter() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    off = np.random.default_rng(1).uniform(-2e-3, 2e-3, len(time))
    jittered, truck = log(time, time + off), log(time, time, wheel_torque=np.zeros(len(time)))
    knees = log(time, time, **{KNEE_TIME: np.zeros(len(time))})
    assert restamp_all([truck, jittered], fitted=1)[0] == (truck, 0.0)
    found = restamp_all([knees, knees, jittered, truck])
    assert [jitter for _, jitter in found[:2]] == [0.0, 0.0]
    assert found[3][1] == found[2][1] > 1e-3


def test_the_reference_of_a_truck_whose_torque_nobody_measured_tells_nothing() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    given = log(time, time, **{TRUCK: np.ones(len(time))})
    given.signals["speed_reference"] += np.random.default_rng(1).normal(0.0, 0.08, len(time))
    assert restamp(given) == (given, None)


def test_rows_off_their_stamps_on_a_wave_of_one_hertz() -> None:
    """A parabola of 20 samples departs from it by up to 2 ms, and moves rows that were in time."""
    time = np.arange(0.0, 15.0, 0.01)
    late = np.random.default_rng(2).uniform(-1.5e-3, 1.5e-3, len(time))
    asked = 200.0 + 30.0 * np.sin(2.0 * np.pi * (time + late))
    found, jitter = restamp(Log(time, {"speed_reference": asked, "motor_speed": time}))
    slope = np.abs(60.0 * np.pi * np.cos(2.0 * np.pi * time))
    error = (found.time - time - late)[slope > 20.0]
    assert jitter == pytest.approx(1.5e-3 / np.sqrt(3.0), rel=0.1)
    assert np.sqrt(np.mean(error**2)) < 0.45 * 1.5e-3 / np.sqrt(3.0)
    assert np.mean((error / found[TIMING_ERROR][slope > 20.0]) ** 2) < 2.0


def test_the_reference_at_the_times_found_is_straight_where_it_was() -> None:
    """Rows that hop between lines make slopes that nobody asked for: 0.01 rad/s in 10 ms is 1."""
    time = np.arange(0.0, 15.0, 0.01)
    off = np.random.default_rng(1).uniform(-2e-3, 2e-3, len(time))
    found, _ = restamp(log(time, time + off))
    middle = (time > 1.6) & (time < 4.4)
    slopes = np.diff(found["speed_reference"][middle]) / np.diff(found.time[middle])
    assert np.max(np.abs(slopes - RATE)) < 2.0


def test_rows_of_a_coarse_reference_on_a_slow_ramp_keep_their_order() -> None:
    """A step of 0.12 rad/s is a whole interval of 10 ms at 10.5 rad/s^2."""
    time = np.arange(0.0, 60.0, 0.01)
    asked = np.interp(time, [0.0, 2.0, 32.0, 50.0, 60.0], [0.0, 0.0, 315.0, 315.0, 262.5])
    coarse = np.round(asked / 0.12) * 0.12
    found, _ = restamp(Log(time, {"speed_reference": coarse, "motor_speed": time}))
    assert np.all(np.diff(found.time) > 0.0)


def test_a_sine_is_no_jitter() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    given = Log(time, {"speed_reference": 200.0 + 50.0 * np.sin(2.0 * time)})
    _, leverage = lateness(given.time, given["speed_reference"])
    assert (leverage < 1.0).any()
    assert restamp(given)[1] == 0.0
