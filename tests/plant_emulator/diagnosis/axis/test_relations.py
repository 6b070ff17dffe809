"""Both sides of the equation of motion through the same kernel, checked by hand."""

import numpy as np
import pytest

from plant_emulator.diagnosis.axis.motion.kernel import Kernel, stride_of

RANDOM = np.random.default_rng(7)
EVEN = np.arange(200) * 0.01
UNEVEN = np.cumsum(RANDOM.uniform(0.004, 0.01, 200))


@pytest.mark.parametrize("time", [EVEN, UNEVEN])
@pytest.mark.parametrize("of_velocity", [False, True])
@pytest.mark.parametrize("stride", [1, 5])
def test_acceleration_of_a_jerk_is_its_average(
    time: np.ndarray, of_velocity: bool, stride: int
) -> None:
    """q = t^3: the averaged acceleration is the average of 6 t, at any times."""
    kernel = Kernel(time, of_velocity, stride)
    measured = 3.0 * time**2 if of_velocity else time**3
    assert kernel.acceleration(measured) == pytest.approx(kernel.average(6.0 * kernel.nodes))


@pytest.mark.parametrize("stride", [1, 4])
def test_average_of_a_constant_is_the_constant(stride: int) -> None:
    kernel = Kernel(UNEVEN, False, stride)
    assert kernel.average(np.full(len(kernel.nodes), 2.5)) == pytest.approx(2.5)


def test_a_fast_wave_passes_both_sides_alike() -> None:
    """15 Hz at 100 Hz: two numerical derivatives would keep 0.74 of it."""
    wave = 2.0 * np.pi * 15.0
    kernel = Kernel(EVEN, False, 1)
    found = kernel.acceleration(np.sin(wave * EVEN))
    law = kernel.average(-(wave**2) * np.sin(wave * kernel.nodes))
    assert np.linalg.norm(found - law) < 2e-3 * np.linalg.norm(law)


@pytest.mark.parametrize("stride", [1, 3, 10])
def test_a_sum_over_neighbours_lowers_the_noise_as_the_stride_expects(stride: int) -> None:
    time = np.arange(60000) * 1e-3
    noise = 1e-6 * RANDOM.standard_normal(len(time))
    found = Kernel(time, False, stride).acceleration(noise).std()
    assert found == pytest.approx(1e-6 * np.sqrt(6.0) / 1e-6 / stride**2.5, rel=0.1)


def test_stride_is_the_least_that_keeps_the_noise_small() -> None:
    time = np.arange(60000) * 1e-3
    measured = 0.1 * np.sin(20.0 * time)
    # Noise of sqrt(6) 1e-6 / h^2 = 2.45 m/s^2 by itself, 0.0245 / sqrt(2) allowed in a relation.
    wanted = stride_of(time, measured, of_velocity=False, noise=1e-6, allowed=0.0245, share=0.03)
    assert wanted == int(np.ceil((100.0 * np.sqrt(2.0)) ** 0.4))
