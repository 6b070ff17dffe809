"""The hysteresis of a sensor is told apart from noise with a long memory."""

import numpy as np
import pytest

from plant_emulator.estimation.hysteresis import ShownValues, hysteresis_squares, play

TIME = np.arange(0.0, 60.0, 0.01)
QUANTITY = 40.0 * np.sin(0.4 * TIME) + 15.0 * np.sin(1.7 * TIME)
EVERY = np.ones(len(TIME), bool)


def wander(seed: int, deviation: float, seconds: float) -> np.ndarray:
    """First-order noise of a deviation and a correlation time, beside white noise of 1."""
    random = np.random.default_rng(seed)
    white, keeps = random.standard_normal((2, len(TIME))), np.exp(-0.01 / seconds)
    slow = np.zeros(len(TIME))
    for k in range(1, len(slow)):
        slow[k] = keeps * slow[k - 1] + np.sqrt(1.0 - keeps**2) * white[1, k]
    return white[0] + deviation * slow


def test_play_follows_by_hand() -> None:
    value = np.array([0.0, 0.5, 2.0, 3.0, 2.5, 1.5, 0.0, 0.5])
    assert play(value, 1.0).tolist() == [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0]


def test_hysteresis_in_white_noise_is_found() -> None:
    """Half width 3: the error y - x is one of the columns. What an offset, a gain and a lag would
    explain of it is not found, and neither is what the noise itself remembers.
    """
    weak = 0.1 * (play(QUANTITY, 3.0) - QUANTITY)
    residual = weak + np.random.default_rng(1).standard_normal(len(TIME))
    found = hysteresis_squares([ShownValues(TIME, QUANTITY, residual, EVERY)])
    others = np.stack([np.ones_like(TIME), QUANTITY, np.gradient(QUANTITY)], axis=-1)
    part = weak - others @ np.linalg.lstsq(others, weak, rcond=None)[0]
    assert 30.0 < found < 1.2 * float(part @ part)


@pytest.mark.parametrize("other", [np.gradient(QUANTITY, TIME), QUANTITY, np.ones_like(TIME)])
def test_lag_gain_and_offset_are_no_hysteresis(other: np.ndarray) -> None:
    """A tenth of the noise of each: 60 squares."""
    residual = 0.1 * other / np.std(other) if np.std(other) else 0.1 * other
    residual = residual + np.random.default_rng(4).standard_normal(len(TIME))
    assert hysteresis_squares([ShownValues(TIME, QUANTITY, residual, EVERY)]) < 15.0


@pytest.mark.parametrize("seed", range(5))
def test_noise_that_wanders_for_a_second_is_no_hysteresis(seed: int) -> None:
    residual = wander(seed, 2.0, 1.0)
    assert hysteresis_squares([ShownValues(TIME, QUANTITY, residual, EVERY)]) < 15.0


def test_hysteresis_shows_beside_noise_that_wanders() -> None:
    residual = wander(7, 1.0, 1.0) + play(QUANTITY, 2.0) - QUANTITY
    assert hysteresis_squares([ShownValues(TIME, QUANTITY, residual, EVERY)]) > 60.0


def test_samples_that_do_not_count_hold_nothing() -> None:
    noise, late = wander(2, 1.0, 0.1), TIME >= 30.0
    error = play(QUANTITY, 3.0) - QUANTITY
    partly = ShownValues(TIME, QUANTITY, noise + np.where(late, 0.0, error), late)
    nothing = ShownValues(TIME, QUANTITY, error, np.zeros(len(TIME), bool))
    silent = ShownValues(TIME, QUANTITY, 0.0 * TIME, EVERY)
    assert hysteresis_squares([partly, nothing, silent]) < 15.0
    assert hysteresis_squares([nothing, silent]) == 0.0
