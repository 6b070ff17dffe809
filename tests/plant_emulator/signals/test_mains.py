"""Lines of the mains in a channel, and the noise beside them."""

import numpy as np
import pytest

from plant_emulator.signals.mains import lines_in_differences, noise_beside_lines
from plant_emulator.signals.noise import NoiseSeries, noise

TIME = np.arange(6000) * 0.01
EVERY = np.ones(len(TIME), bool)


def white(seed: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.random.default_rng(seed).standard_normal(len(TIME))


@pytest.mark.parametrize("amplitude", [1.0, 2.0, 4.0])
def test_hum_leaves_the_noise_alone(amplitude: float) -> None:
    """Third differences alone take hum near half the sampling rate for noise."""
    hum = amplitude * np.cos(2.0 * np.pi * 50.03 * TIME + 0.4)
    channel = 30.0 * np.sin(TIME) + white(1) + hum
    assert noise(channel) > 1.3
    assert noise_beside_lines(TIME, channel, EVERY) == pytest.approx(1.0, rel=0.06)


def test_channel_without_hum_has_the_noise_of_its_third_differences() -> None:
    channel = 30.0 * np.sin(TIME) + white(2)
    assert noise_beside_lines(TIME, channel, EVERY) == noise(channel)


def test_line_shows_beside_a_misfit_that_is_far_larger() -> None:
    misfit = 200.0 * (np.sin(3.0 * TIME) + (TIME % 7.0 < 0.03))
    value = misfit + white(3) + 2.0 * np.cos(2.0 * np.pi * 49.97 * TIME)
    ((line, double),), level = lines_in_differences(
        [NoiseSeries(time=TIME, value=value, use=EVERY)], [EVERY]
    )
    folded = abs(line - 50.0)  # sampled at 100 Hz, 49.97 and 50.03 Hz are the same
    assert folded == pytest.approx(0.03, abs=0.002)
    assert double == pytest.approx(2.0 * line)
    assert level == pytest.approx(1.0, rel=0.1)


def test_channel_without_four_values_in_a_row_shows_no_line() -> None:
    held = np.arange(len(TIME)) % 3 == 0
    value = white(4) + 2.0 * np.cos(2.0 * np.pi * 50.0 * TIME)
    lines, _ = lines_in_differences([NoiseSeries(time=TIME, value=value, use=held)], [held])
    assert lines == [()]
