"""Noise of a channel from its third differences."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.signals.log import Log
from plant_emulator.signals.noise import FLOOR, noise, value_step

TIME = np.arange(4000) * 0.01


@pytest.mark.parametrize("step", [0.0, 0.1, 0.5])
def test_noise_on_a_moving_quantised_signal_with_spikes_is_found(step: float) -> None:
    random = np.random.default_rng(4)
    channel = 30.0 * np.sin(TIME) + 0.25 * random.standard_normal(len(TIME))
    channel[::400] += 40.0
    if step:
        channel = np.round(channel / step) * step
    quantised = np.hypot(0.25, step / np.sqrt(12.0))  # a converter adds step^2 / 12
    assert noise(channel) == pytest.approx(quantised, rel=0.06)


def test_smooth_signal_has_the_floor_only() -> None:
    assert noise(30.0 * np.sin(TIME)) == pytest.approx(60.0 * FLOOR, rel=1e-3)


def test_samples_that_do_not_count_leave_the_noise_alone() -> None:
    channel = np.random.default_rng(5).standard_normal(len(TIME))
    held = channel[np.arange(len(TIME)) // 1000 * 1000]
    use = np.ones(len(TIME), bool)
    use[:1500] = False
    mixed = np.where(use, channel, held)
    assert noise(mixed, use) == pytest.approx(1.0, rel=0.06)


@pytest.mark.parametrize(
    ("channel", "level"),  # the levels that the independent bench's logs were made with
    [
        ("motor_speed", 0.15),
        ("drum_speed", 0.01),
        ("armature_current", 0.25),
        ("shaft_torque", 0.25),
    ],
)
@pytest.mark.parametrize("program", [1, 2, 3])
def test_noise_of_the_independent_logs_is_found(
    bench_log: Callable[[str], Log], channel: str, level: float, program: int
) -> None:
    log = bench_log(f"bench_practice/practice_004/program{program}")
    assert noise(log[channel]) == pytest.approx(level, rel=0.07)


def test_noise_of_a_channel_slower_than_its_log_is_that_of_its_fresh_samples() -> None:
    random = np.random.default_rng(6)
    smooth = np.sin(0.2 * TIME)
    held = (smooth + 0.25 * random.standard_normal(len(TIME)))[np.arange(len(TIME)) // 5 * 5]
    fresh = np.arange(len(TIME)) % 5 == 0
    assert noise(held, fresh) == pytest.approx(0.25, rel=0.08)


@pytest.mark.parametrize("step", [0.02175, 0.5])
def test_values_of_a_quantised_channel_are_a_step_apart(step: float) -> None:
    random = np.random.default_rng(4)
    value = 3.0 + 2.0 * np.sin(np.linspace(0.0, 9.0, 4000)) + random.normal(0.0, 0.01, 4000)
    assert value_step(np.round(value / step) * step) == pytest.approx(step)
    assert value_step(value) == 0.0
    assert value_step(np.full(4000, 3.0)) == 0.0
