"""Noise and resolution of the sensors, as the independent bench's noisy logs have them."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.signals.log import Log
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise

# signal -> noise rms, quantisation step (README of the data, one more digit)
LEVELS = {
    "motor_speed": (0.15, 0.07324),
    "drum_speed": (0.01, 0.0048828),
    "armature_current": (0.25, 0.048828),
    "shaft_torque": (0.25, 0.024414),
    "wheel_torque": (2.0, 0.7324),
    "armature_voltage": (1.0, 0.24414),  # assumed: the data have none
}
TIME = 0.01 * np.arange(20_000)
STILL = Log(TIME, {"speed_reference": np.ones(20_000), **{k: np.full(20_000, 7.0) for k in LEVELS}})


@pytest.mark.parametrize("signal", LEVELS)
def test_noise_has_its_level_and_resolution(signal: str) -> None:
    deviation, step = LEVELS[signal]
    shown = add_noise(STILL, 1)[signal]
    assert np.std(shown) == pytest.approx(np.hypot(deviation, step / np.sqrt(12)), rel=0.03)
    assert shown.mean() == pytest.approx(7.0, abs=0.05 * deviation)
    counts = shown / step
    assert np.abs(counts - np.round(counts)).max() < 0.02


@pytest.mark.parametrize(
    "signal", ["motor_speed", "drum_speed", "armature_current", "shaft_torque"]
)
def test_resolution_is_that_of_the_noisy_logs(signal: str, bench_log: Callable[[str], Log]) -> None:
    shown = bench_log("bench_practice/practice_004/program1")[signal]
    counts = shown / SENSORS[signal][1]
    assert np.abs(counts - np.round(counts)).max() < 0.01


def test_noise_is_drawn_from_its_seed() -> None:
    assert np.array_equal(add_noise(STILL, 3)["motor_speed"], add_noise(STILL, 3)["motor_speed"])
    assert not np.array_equal(
        add_noise(STILL, 3)["motor_speed"], add_noise(STILL, 4)["motor_speed"]
    )


def test_reference_and_time_stay_exact() -> None:
    shown = add_noise(STILL, 1)
    assert np.array_equal(shown["speed_reference"], STILL["speed_reference"])
    assert np.array_equal(shown.time, TIME)
