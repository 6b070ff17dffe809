"""Laws of the axis' effects against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.effects.effect import Scale
from plant_emulator.diagnosis.axis.effects.friction import bristle
from plant_emulator.diagnosis.axis.effects.gap import crossed
from plant_emulator.diagnosis.axis.motion.run import Motion

Array = NDArray[np.float64]
BY_NAME = {effect.name: effect for effect in LIBRARY}
TIME = np.arange(0.0, 4.0, 1e-3)


def test_a_rise_of_friction_needs_room_above_the_width_of_its_sign() -> None:
    """It is four widths at least and a fifth of the highest speed at most."""
    scale = Scale(
        force=1.0,
        speed=1.0,
        acceleration=1.0,
        middle=0.0,
        travel=1.0,
        period=1e-3,
        length=10.0,
        rotary=True,
        width=0.04,
    )
    assert BY_NAME["stribeck"].has_room(scale)
    assert not BY_NAME["stribeck"].has_room(replace(scale, width=0.06))


def test_a_bristle_bends_exponentially_and_turns_with_the_motion() -> None:
    there = np.linspace(0.0, 1.0, 400)
    found = bristle(np.concatenate([there, there[-2::-1]]), 0.1)
    assert found[40] == pytest.approx(1.0 - np.exp(-there[40] / 0.1))
    # From +1 the state falls as 2 exp(-x / 0.1) - 1 on the way back.
    assert found[399 + 40] == pytest.approx(2.0 * np.exp(-there[40] / 0.1) - 1.0, abs=1e-3)


def test_a_load_flies_through_its_gap_and_is_caught() -> None:
    """The motor brakes with 4 m/s2 from 1 m/s; the load, slowed with 1 m/s2, leaves it at once.

    Way of the load less that of the motor: 3 t^2 / 2 = 0.06 m at 0.2 s. Then the motor has 0.2 m/s
    and the load 0.8 m/s.
    """
    time = np.arange(0.0, 0.21, 1e-3)
    motion = moved(time, time - 2.0 * time**2, 1.0 - 4.0 * time, np.full(len(time), -4.0))
    motion.acceleration[0] = 1.0
    free, hit = crossed(motion, 0.03, 1.0)
    first = int(np.flatnonzero(hit)[0])
    assert time[first] == pytest.approx(0.2, abs=2e-3)
    assert not free[0]
    assert free[1:first].all()
    # A node at a sample counts for a third of two steps, one between for two thirds.
    impulse = hit[first] * 2e-3 / 3.0 * (2.0 if first % 2 else 1.0)
    assert impulse == pytest.approx(0.2 - 0.8, abs=0.02)


def test_a_load_that_brakes_harder_than_its_motor_stays_at_its_flank() -> None:
    time = np.arange(0.0, 0.2, 1e-3)
    motion = moved(time, time - 2.0 * time**2, 1.0 - 4.0 * time, np.full(len(time), -4.0))
    free, hit = crossed(motion, 0.03, 5.0)
    assert not free.any()
    assert not hit.any()


def moved(time: Array, position: Array, velocity: Array, acceleration: Array) -> Motion:
    return Motion(
        time=time,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        direction=np.sign(velocity),
        slope=np.zeros(len(time)),
        slow=np.zeros(len(time), np.bool_),
        deviation=0.0,
    )


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
