"""One channel of a road log: even samples, holes, spikes, noise, low pass and clock offset."""

import numpy as np
import pytest

from plant_emulator.errors import LogError
from plant_emulator.road_load.clock_offset import clock_ahead
from plant_emulator.road_load.signal import Signal, find_rests, low_pass, noise, signal

TIME = np.arange(5000) * 0.002
DRAW = np.random.default_rng(3)
NOISY = np.sin(TIME) + 0.01 * DRAW.standard_normal(5000)


def test_even_samples_stay_as_they_are() -> None:
    found = signal(TIME, NOISY, "log")
    assert found.period == pytest.approx(0.002)
    assert np.allclose(found.values, NOISY)
    assert found.valid.all()
    assert found.holes() == []


def test_stamps_in_seconds_since_1970_are_even_samples_too() -> None:
    """A double holds them to 0.24 us, which is 0.1 permille of a sample."""
    found = signal(1.7e9 + TIME, NOISY, "log")
    assert len(found.values) == 5000
    assert found.valid.all()


def test_late_stamps_make_no_hole() -> None:
    found = signal(TIME + DRAW.uniform(-3e-4, 3e-4, 5000), NOISY, "log")
    assert len(found.values) == pytest.approx(5000, abs=1)
    assert found.holes() == []


def test_lost_samples_are_a_hole_with_its_place_and_length() -> None:
    kept = (TIME < 3.0) | (TIME >= 3.5)
    [(start, length)] = signal(TIME[kept], NOISY[kept], "log").holes()
    assert (start, length) == pytest.approx((2.998, 0.502), abs=0.0021)


def test_values_that_the_logger_held_are_a_hole() -> None:
    held = np.where((TIME >= 3.0) & (TIME < 3.5), NOISY[1500], NOISY)
    [(start, length)] = signal(TIME, held, "log").holes()
    assert (start, length) == pytest.approx((3.0, 0.5), abs=0.0041)


def test_a_wheel_that_stands_is_no_hole() -> None:
    still = np.where((TIME >= 3.0) & (TIME < 3.5), 0.0, NOISY)
    assert signal(TIME, still, "log", rest=0.0).holes() == []
    assert len(signal(TIME, still, "log").holes()) == 1


def test_signal_without_noise_may_stand_still() -> None:
    steps = np.repeat([1.0, 2.0, 3.0, 2.0, 1.0], 1000)
    assert signal(TIME, steps, "log").holes() == []


def test_single_spike_is_interpolated() -> None:
    found = signal(TIME, np.where(np.arange(5000) == 700, 9.0, NOISY), "log")
    assert found.values[700] == pytest.approx(np.sin(1.4), abs=0.05)


def test_values_each_written_several_times_are_refused_with_their_true_rate() -> None:
    with pytest.raises(LogError, match=r"log: every value occurs 5 times.*at 100 Hz and held"):
        signal(TIME, np.repeat(NOISY[::5], 5), "log")


def test_slow_log_is_refused() -> None:
    with pytest.raises(LogError, match=r"log: 5 samples a second; at least 20"):
        signal(TIME * 100.0, NOISY, "log")


def test_noise_is_that_of_the_fast_part_alone() -> None:
    assert noise(5.0 * NOISY) == pytest.approx(0.05, rel=0.05)


def test_low_pass_removes_the_fast_part_and_delays_nothing() -> None:
    slow, fast = np.sin(2 * np.pi * TIME), np.sin(2 * np.pi * 150.0 * TIME)
    inside = slice(200, -200)
    assert low_pass(slow + fast, 0.002, 40.0)[inside] == pytest.approx(slow[inside], abs=5e-3)


def test_low_pass_leaves_a_signal_that_has_nothing_above_it() -> None:
    assert low_pass(NOISY, 0.002, 250.0) is NOISY


def test_standstill_is_where_speed_is_zero_for_a_while() -> None:
    """A speed that only crosses zero is no standstill."""
    speed = np.interp(TIME, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0], [1.0, 0.0, 0.0, 1.0, -1.0, -1.0])
    found = TIME[find_rests(speed + 0.01 * DRAW.standard_normal(5000), 0.002)]
    assert 2.0 < found.min() < 2.3
    assert 3.9 < found.max() < 4.1


def channel(values: np.ndarray, source: str, start: float = 0.0) -> Signal:
    valid = np.ones(len(values), dtype=bool)
    return Signal(start=start, period=0.01, values=values, valid=valid, source=source)


@pytest.mark.parametrize("shift", [-150, 0, 37, 400])
def test_clock_offset_is_found(shift: int) -> None:
    """The acceleration has the shape of the torque, `shift` samples later on its own clock."""
    bumps = 0.05 * np.convolve(DRAW.standard_normal(6000), np.hanning(300), mode="same")
    torque = channel(bumps, "torque")
    moved = np.cumsum(np.roll(bumps, -shift)) * 0.01
    assert clock_ahead(torque, channel(moved, "velocity")) == pytest.approx(shift * 0.01, abs=0.02)


def test_opposite_signs_are_refused() -> None:
    bumps = 0.05 * np.convolve(DRAW.standard_normal(6000), np.hanning(300), mode="same")
    moved = channel(-np.cumsum(bumps) * 0.01, "velocity")
    with pytest.raises(LogError, match=r"torque, velocity: .*opposite signs.*wrong sign"):
        clock_ahead(channel(bumps, "torque"), moved)
