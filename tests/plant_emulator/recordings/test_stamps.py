"""Stamps corrected by the reference: what was done to them is what is found."""

from __future__ import annotations

import numpy as np
import pytest

from plant_emulator.recordings.stamps import lateness, restamp
from plant_emulator.signals.log import Log

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
    assert jitter == pytest.approx(2e-3 / np.sqrt(3.0), rel=0.35)
    error = (found.time - time - off)[ramp]
    assert np.sqrt(np.mean(error**2)) < 0.3 * 2e-3 / np.sqrt(3.0)
    steady = (time > 5.5) & (time < 9.5)
    assert np.array_equal(found.time[steady], time[steady])


def test_rows_on_their_stamps_stay() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    given = log(time, time)
    found, jitter = restamp(given)
    assert jitter == 0.0
    assert found is given


def test_a_staircase_tells_nothing() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    given = log(time, time + 1e-3 * np.sin(time), wheel_torque=np.zeros(len(time)))
    assert restamp(given) == (given, 0.0)


def test_a_sine_is_no_jitter() -> None:
    time = np.arange(0.0, 15.0, 0.01)
    given = Log(time, {"speed_reference": 200.0 + 50.0 * np.sin(2.0 * time)})
    _, told = lateness(given.time, given["speed_reference"])
    assert told.any()
    assert restamp(given)[1] == 0.0
