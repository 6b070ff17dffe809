"""Estimates the wheel torque of a truck that stood on the drum with nobody measuring its torque.

The relation of gear and drum holds over every interval between two samples (thesis, eq. 3.20 and
3.34, in contact and in the gap), with T_d the torque of the truck at the drum:

    T_d = xi T + T_f(omega_m / xi) + J_g omega_m' / xi + J_d omega_d'

The derivative of the measured drum speed is noise above all. So T_d is smoothed: the true drum
speed w and the torque T_d are the unknowns of a tridiagonal least squares problem, with a random
walk of T_d (fixed-interval smoothing; H. Rauch, F. Tung, C. Striebel, AIAA Journal 3 (1965) 1445).

The estimate takes parameters, torque sensor and friction as the set has them. What it misses is an
unknown input of the run: `input_noise` gives every window of the torque a standard deviation, and
an analysis takes nothing for information that such an error of the torque could explain.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from plant_emulator.model.array_laws import sliding_friction
from plant_emulator.signals.log import TRUCK, WHEEL_TORQUE, Log
from plant_emulator.signals.noise import noise

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.signals.log import Array

# Random walk of the torque at the drum [N m / sqrt(s)]. Its changes have Cauchy's distribution: the
# torque drifts, and jumps where a driver steps on a pedal; so many reweightings find the jumps.
WALK, ITERATIONS = 300.0, 12
# Speed of the gear's output below which the direction of its friction is open [rad/s].
STICKING_SPEED = 0.02
# What is not known of the torque: standard deviation of its mean over a window [N m at the wheel].
# At the drum it is 560 N m, half of the gear's friction at full speed. The window [s] is shorter
# than the estimate is smooth, so that its errors lie in the windows.
ERROR, ERROR_WINDOW = 150.0, 0.05
# Parameters of the estimate, and the gain error that a torque sensor may have [1].
TAKEN = (
    "gear_coulomb_friction",
    "gear_viscous_friction",
    "gear_friction_exponent",
    "drum_inertia",
)
SENSOR_GAIN_ERROR = 0.01
# Samples to either side over which the torque of the gear is averaged.
REACH = 5
# Torque that keeps gear and drum in contact for certain [N m at the drum]: a sixth of the gear's
# friction at full speed, which the friction may be off by. After a flight through the gap the drive
# settles so long, and before it as much of the estimate is uncertain [s].
LOOSE, LOOSE_BEFORE, LOOSE_AFTER = 150.0, 0.1, 1.0
# Drum speed below which the gear may stick [rad/s]: a thirtieth of its speed in use.
CREEPING = 0.2
# Change of the torque within a window that is a jump [N m at the wheel]: two amperes' worth.
JUMP = 40.0


def with_estimated_torque(log: Log, p: Mapping[str, float]) -> Log:
    """The log with an estimate of the wheel torque, where a truck's torque was not measured.

    p : parameter values [SI]
    A log without the mark of a truck stays as it is, and so does one with a measured torque.
    """
    if WHEEL_TORQUE in log or TRUCK not in log or not np.any(log[TRUCK] > 0.5):
        return log
    torque = p["wheel_radius"] / p["drum_radius"] * drum_torque(log, p)
    return replace(log, signals={**log.signals, WHEEL_TORQUE: torque})


def is_estimated(log: Log) -> bool:
    """Whether the wheel torque of a log is an estimate of an unknown torque."""
    return WHEEL_TORQUE in log and TRUCK in log and bool(np.any(log[TRUCK] > 0.5))


def deviation(log: Log, parameters: ParameterSet) -> Array:
    """Standard deviation of the estimated wheel torque [N m], shape (n,).

    The priors of the parameters that the estimate takes, and the gain of the torque sensor.
    """
    p = parameters.values()
    share = p["wheel_radius"] / p["drum_radius"]
    base = drum_torque(log, p)
    changed = [
        drum_torque(log, {**p, name: p[name] + std})
        for name in TAKEN
        if (std := parameters[name].std) is not None
    ]
    signals = {**log.signals, "shaft_torque": (1.0 + SENSOR_GAIN_ERROR) * log["shaft_torque"]}
    changed.append(drum_torque(replace(log, signals=signals), p))
    return np.asarray(share * np.sqrt(sum((other - base) ** 2 for other in changed)))


def mark_informative(log: Log, p: Mapping[str, float]) -> NDArray[np.bool_]:
    """Samples of a run with an unknown torque that count, shape (n,); p : parameter values [SI].

    Where the gear passes hardly any torque to the drum, the drum may float in the gap or stand with
    its brake on. When it meets the gear again depends on the unknown torque far from linearly.
    Where the torque jumps within a window, its mean over the window says too little. Near
    standstill friction and brake take any torque.
    """
    known, _ = _gear_side(log, p)
    passed = uniform_filter1d(np.append(known, known[-1]), 2 * REACH + 1)
    interval = float(np.median(np.diff(log.time)))
    before, after = (round(span / interval) for span in (LOOSE_BEFORE, LOOSE_AFTER))
    window = max(1, round(ERROR_WINDOW / interval))
    jump = np.abs(log[WHEEL_TORQUE][window:] - log[WHEEL_TORQUE][:-window]) > JUMP
    unsure = (np.abs(passed) < LOOSE) | np.append(jump, np.zeros(window, bool))
    unsure |= np.abs(uniform_filter1d(log["drum_speed"], 2 * REACH + 1)) < CREEPING
    wide = maximum_filter1d(unsure, before + after + 1, origin=(after - before) // 2)
    return np.asarray(~wide)


def drum_torque(log: Log, p: Mapping[str, float]) -> Array:
    """Smoothed torque of the truck at the drum [N m] in the interval that ends at each sample.

    It is 0 until the drum first moves: the truck is parked. p : parameter values [SI]
    """
    from scipy.linalg import solveh_banded

    step = np.diff(log.time)
    inertia = p["drum_inertia"] / step
    known, deviation = _gear_side(log, p)
    speed, spread = log["drum_speed"], noise(log["drum_speed"])
    n = len(speed)
    # Unknowns side by side: w_0, T_1, w_1, T_2, ...; the interval k holds w_(k-1), T_k, w_k.
    banded, right = np.zeros((3, 2 * n - 1)), np.zeros(2 * n - 1)
    banded[0, ::2] += spread**-2.0
    right[::2] += speed * spread**-2.0
    weight = deviation**-2.0
    rows = ((inertia, slice(0, -1, 2)), (1.0, slice(1, None, 2)), (-inertia, slice(2, None, 2)))
    for coefficient, place in rows:
        banded[0, place] += weight * coefficient**2
        right[place] += weight * coefficient * known
    banded[1, 0:-1:2] += weight * inertia
    banded[1, 1::2] -= weight * inertia
    banded[2, 0:-1:2] -= weight * inertia**2
    walk = WALK**2 * 0.5 * (step[1:] + step[:-1])
    change = np.zeros(n - 2)
    for _ in range(ITERATIONS):
        found = solveh_banded(_with_walk(banded, 2.0 / (walk + change**2)), right, lower=True)
        change = np.diff(found[1::2])
    first = first_motion(found[::2], speed)
    return np.concatenate([[0.0], np.where(np.arange(1, n) <= first, 0.0, found[1::2])])


def _with_walk(banded: Array, weight: Array) -> Array:
    """Normal equations with a walk of the torque; weight : of each of its changes, (n - 2,)."""
    whole = banded.copy()
    whole[0, 1:-2:2] += weight
    whole[0, 3::2] += weight
    whole[2, 1:-2:2] -= weight
    return whole


def _gear_side(log: Log, p: Mapping[str, float]) -> tuple[Array, Array]:
    """Torque of the truck that is not spent on the drum's inertia, and its deviation [N m].

    Both are means over the intervals, shape (n - 1,).
    """
    xi, step, motor_speed = p["gear_ratio"], np.diff(log.time), log["motor_speed"]
    gear_speed = motor_speed / xi
    friction = sliding_friction(gear_speed, p) * np.clip(gear_speed / STICKING_SPEED, -1.0, 1.0)
    gear = p["gear_inertia"] / (xi * step)
    torque = xi * log["shaft_torque"] + friction
    known = 0.5 * (torque[1:] + torque[:-1]) + gear * np.diff(motor_speed)
    spread = xi * noise(log["shaft_torque"]), noise(motor_speed)
    return known, np.hypot(np.sqrt(0.5) * spread[0], np.sqrt(2.0) * gear * spread[1])


def first_motion(smooth: Array, speed: Array) -> int:
    """Sample from which on the drum moves.

    smooth, speed : smoothed and measured speed of the drum [rad/s], shape (n,)
    """
    moving = np.abs(speed) > max(STICKING_SPEED, 6.0 * noise(speed))
    certain = int(np.argmax(moving)) if moving.any() else len(moving)
    still = np.flatnonzero(smooth[:certain] * np.sign(smooth[certain - 1]) <= 0.0)
    return int(still[-1]) if len(still) else 0
