"""One correction of a run that is led along measured speeds, by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from plant_emulator.model.stage import BACKLASH, DRUM_SPEED, GEAR_SPEED, MOTOR_SPEED
from plant_emulator.solver.observer import OBSERVER_GAIN, correct

HALF_GAP, GEAR_RATIO = 0.15, 60.0
# Two samples: the motor turns at 100 rad/s and the drum at 1.7 rad/s in the simulation.
SHOWN = np.array([[100.0, 1.7], [100.0, 1.7]])


def correction(motor: list[float], drum: list[float], angle: float) -> dict[int, float]:
    """What a correction adds to the speeds, with dead zones of 0.1 and 0.02 rad/s, by state."""
    x = np.zeros(8)
    x[BACKLASH] = angle
    stage: Any = SimpleNamespace(backlash_half_gap=HALF_GAP)
    parameters: Any = SimpleNamespace(gear_ratio=GEAR_RATIO)
    measured = (np.array(motor), np.array(drum), np.array([0.1, 0.02]))
    correct(0, 1, measured, SHOWN, x, stage, parameters)
    return {k: float(x[k]) / OBSERVER_GAIN for k in (MOTOR_SPEED, GEAR_SPEED, DRUM_SPEED)}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_speeds_are_corrected_beyond_their_dead_zones(sign: float) -> None:
    found = correction([100.0 + sign * 0.2, 100.0 + sign * 0.4], [1.7 + sign * 0.05] * 2, 0.1)
    assert found[MOTOR_SPEED] == pytest.approx(sign * 0.2)
    assert found[GEAR_SPEED] == pytest.approx(sign * 0.2 / 60.0)
    assert found[DRUM_SPEED] == pytest.approx(sign * 0.03)


def test_drum_moves_with_the_gear_in_contact() -> None:
    found = correction([100.2, 100.4], [9.0, 9.0], 0.151)
    assert found[DRUM_SPEED] == pytest.approx(0.2 / 60.0)


def test_miss_within_the_noise_corrects_nothing() -> None:
    found = correction([100.09, 100.11], [1.681, np.nan], -0.1)
    assert list(found.values()) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
