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


def test_hysteresis_in_white_noise_holds_the_squares_of_its_error() -> None:
    """Half width 3: the error y - x is one of the columns, so that it is found whole."""
    error = play(QUANTITY, 3.0) - QUANTITY
    weak = 0.05 * error
    residual = weak + np.random.default_rng(1).standard_normal(len(TIME))
    found = hysteresis_squares([ShownValues(TIME, QUANTITY, residual, EVERY)])
    assert found == pytest.approx(float(weak @ weak), rel=0.3)


@pytest.mark.parametrize("seed", range(5))
def test_noise_that_wanders_for_a_second_is_no_hysteresis(seed: int) -> None:
    residual = wander(seed, 2.0, 1.0)
    assert hysteresis_squares([ShownValues(TIME, QUANTITY, residual, EVERY)]) < 15.0


def test_hysteresis_shows_beside_noise_that_wanders() -> None:
    residual = wander(7, 1.0, 1.0) + play(QUANTITY, 2.0) - QUANTITY
    assert hysteresis_squares([ShownValues(TIME, QUANTITY, residual, EVERY)]) > 60.0


def test_samples_that_do_not_count_hold_nothing() -> None:
    residual = np.where(TIME < 30.0, 0.0, np.random.default_rng(2).standard_normal(len(TIME)))
    assert hysteresis_squares([ShownValues(TIME, QUANTITY, residual, TIME >= 30.0)]) < 15.0
    assert hysteresis_squares([ShownValues(TIME, QUANTITY, 0.0 * TIME, EVERY)]) == 0.0
