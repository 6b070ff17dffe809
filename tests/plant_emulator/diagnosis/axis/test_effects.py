"""Laws of the axis' effects against closed forms."""

import numpy as np
import pytest

from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.effects.friction import bristle
from plant_emulator.diagnosis.axis.effects.motion_and_force import engaged

BY_NAME = {effect.name: effect for effect in LIBRARY}
TIME = np.arange(0.0, 4.0, 1e-3)


def test_a_bristle_bends_exponentially_and_turns_with_the_motion() -> None:
    there = np.linspace(0.0, 1.0, 400)
    found = bristle(np.concatenate([there, there[-2::-1]]), 0.1)
    assert found[40] == pytest.approx(1.0 - np.exp(-there[40] / 0.1))
    # From +1 the state falls as 2 exp(-x / 0.1) - 1 on the way back.
    assert found[399 + 40] == pytest.approx(2.0 * np.exp(-there[40] / 0.1) - 1.0, abs=1e-3)


def test_a_gap_is_crossed_once_after_every_reversal() -> None:
    position = np.concatenate([np.linspace(0.0, 1.0, 101), np.linspace(0.99, 0.0, 100)])
    found = engaged(position, 0.1)
    assert found.sum() == pytest.approx(len(position) - 10 - 20, abs=2)
    assert not found[101:119].any()
    assert found[122:].all()


def test_a_lag_follows_a_ramp_by_its_time() -> None:
    lag = BY_NAME["force_lag"].replaced
    assert lag is not None
    found = lag(lambda t: 3.0 * t, TIME, {"time": 0.2})
    exact = 3.0 * (TIME - 0.2 * (1.0 - np.exp(-TIME / 0.2)))
    assert found == pytest.approx(exact, abs=1e-9)


def test_a_delay_shifts_the_force() -> None:
    delay = BY_NAME["delay"].replaced
    assert delay is not None
    found = delay(np.sin, TIME, {"time": 0.05})
    assert found[50:] == pytest.approx(np.sin(TIME[50:] - 0.05))
