"""Simulates a truck on a level road and its two loggers, for tests of its identification.

Explicit Euler with steps of 0.2 ms integrates the truck with its own model of standstill. The
driver's torque follows with a lag. Nothing here uses the code under test.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 2e-4
FULL_CYCLE = ((2.0, 4.0), (16.0, 0.0), (24.0, -3.0), (38.0, 0.0), (46.0, 2.3), (56.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class Truth:
    """True parameters, by the names and in the units of the answer, and properties of the loggers.

    grade : largest grade of the road's waves, which are 16 m long [1]; the model assumes 0
    """

    mass: float = 3640.0
    crr: float = 0.0115
    crr_v: float = 6e-6
    efficiency: float = 0.9
    gain: float = 1.008
    offset: float = -0.4
    ahead: float = 0.03
    ppm: float = 25.0
    torque_rate: float = 500.0
    velocity_rate: float = 1000.0
    torque_noise: float = 0.35
    velocity_noise: float = 0.01
    grade: float = 0.0
    duration: float = 60.0
    targets: Sequence[tuple[float, float]] = FULL_CYCLE


def drive(truth: Truth) -> tuple[Array, Array, Array]:
    """Time [s], velocity [m/s] and motor torque [N m] of the drive."""
    count = round(truth.duration / STEP) + 1
    velocity, torque = np.zeros(count), np.zeros(count)
    v = t = x = 0.0
    target, turn = 0.0, 0
    for k in range(1, count):
        if turn < len(truth.targets) and k * STEP >= truth.targets[turn][0]:
            target = truth.targets[turn][1]
            turn += 1
        wanted = 0.0 if target == 0.0 and abs(v) < 0.02 else 90.0 * (target - v)
        t += STEP / 0.12 * (min(max(wanted, -60.0), 60.0) - t)
        v = step_velocity(truth, v, t)
        v -= STEP * 9.81 * truth.grade * np.sin(x / 2.5) if v != 0.0 else 0.0
        x += STEP * v
        velocity[k], torque[k] = v, t
    return STEP * np.arange(count), velocity, torque


def step_velocity(truth: Truth, v: float, torque: float) -> float:
    """Velocity after one step [m/s]; wheel 0.1715 m, ratio 14, drum 0.645 m, 9.81 m/s^2."""
    driving = torque * v > 0.0 or v == 0.0
    wheel = 14.0 * torque * (truth.efficiency if driving else 1.0 / truth.efficiency) / 0.1715
    road = truth.mass * 9.81 * (truth.crr + truth.crr_v * abs(v) / 0.645)
    if v == 0.0 and abs(wheel) <= road:
        return 0.0
    direction = np.sign(v) if v != 0.0 else np.sign(wheel)
    after = v + STEP * (wheel - direction * road) / truth.mass
    return 0.0 if v * after < 0.0 else float(after)


def record(truth: Truth, seed: int) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Time and torque of one logger, time and velocity of the other."""
    draw = np.random.default_rng(seed)
    time, velocity, torque = drive(truth)
    torque_time = np.arange(round(truth.duration * truth.torque_rate)) / truth.torque_rate
    shown = np.interp(torque_time, time, torque) * truth.gain + truth.offset
    shown += truth.torque_noise * draw.standard_normal(len(shown))
    stamp = np.arange(round(truth.duration * truth.velocity_rate)) / truth.velocity_rate
    seen = np.interp(stamp * (1.0 + 1e-6 * truth.ppm) + truth.ahead, time, velocity)
    seen += truth.velocity_noise * draw.standard_normal(len(seen))
    return (torque_time, np.round(shown, 3)), (stamp, 0.002 * np.round(seen / 0.002))


def draw_truth(seed: int) -> Truth:
    """Draw a truck, its loggers and its drive."""
    draw = np.random.default_rng(seed)
    return Truth(
        mass=float(draw.choice([3640.0, 5240.0])),
        crr=draw.uniform(0.0095, 0.0122),
        crr_v=draw.uniform(0.0, 1e-5),
        efficiency=draw.uniform(0.86, 0.94),
        gain=draw.normal(1.0, 0.01),
        offset=draw.uniform(-0.8, 0.8),
        ahead=draw.uniform(-0.06, 0.06),
        ppm=draw.uniform(-60.0, 60.0),
        targets=[
            (start + draw.uniform(-0.3, 0.3), speed * draw.uniform(0.9, 1.1))
            for start, speed in FULL_CYCLE
        ],
    )
