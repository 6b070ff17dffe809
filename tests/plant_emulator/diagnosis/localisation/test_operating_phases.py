"""Phases of operation of hand-made runs."""

import numpy as np
import pytest

from plant_emulator.diagnosis.localisation.operating_phases import PHASES, field_weakened, phases

TIME = np.arange(0.0, 20.0, 0.01)
# 1 s rest, up to 200 rad/s within 4 s, 5 s there, down within 4 s, rest.
REFERENCE = np.interp(TIME, [0.0, 1.0, 5.0, 10.0, 14.0, 20.0], [0.0, 0.0, 200.0, 200.0, 0.0, 0.0])
DEAD_TIME = 0.1
SPEED = np.interp(TIME - DEAD_TIME, TIME, REFERENCE)


def phase_at(time: float, speed: np.ndarray = SPEED) -> str:
    return PHASES[phases(TIME, REFERENCE, speed)[round(100 * time)]]


@pytest.mark.parametrize(
    ("time", "phase"),
    [
        (0.5, "standstill"),
        (1.08, "breakaway"),  # the reference moves, the motor not yet
        (1.4, "breakaway"),
        (3.0, "acceleration"),
        (7.5, "cruise"),
        (12.0, "deceleration"),
        (16.0, "standstill"),
    ],
)
def test_every_part_of_a_trapezoid_has_its_phase(time: float, phase: str) -> None:
    assert phase_at(time) == phase


def test_running_backwards_has_the_same_phases() -> None:
    assert np.array_equal(phases(TIME, -REFERENCE, -SPEED), phases(TIME, REFERENCE, SPEED))


def test_noise_of_the_tachometer_changes_no_phase_outside_the_transitions() -> None:
    noisy = SPEED + 0.15 * np.random.default_rng(1).standard_normal(len(TIME))
    differs = phases(TIME, REFERENCE, noisy) != phases(TIME, REFERENCE, SPEED)
    assert differs.mean() < 0.01


def test_creeping_after_a_stop_is_standstill() -> None:
    creeping = np.where(TIME > 15.0, -0.3, SPEED)
    assert phase_at(18.0, creeping) == "standstill"


def test_the_field_is_weakened_above_base_speed_in_both_directions() -> None:
    found = field_weakened(np.array([-200.0, -180.0, 0.0, 180.0, 200.0]), 190.0)
    assert found.tolist() == [True, False, False, False, True]
