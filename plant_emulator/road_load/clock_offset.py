"""How far the two loggers' clocks are apart, to start from, and whether the two logs fit (pure).

A motor's torque and the truck's acceleration have nearly the same shape. Their cross-correlation
has its peak where one clock is shifted onto the other; what the logs are of (another run, a wrong
sign, a constant speed) shows in the peak, before anything is fitted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.road_load.signal import low_pass, noise

if TYPE_CHECKING:
    from plant_emulator.road_load.signal import Mask, Signal
    from plant_emulator.signals.log import Array

PERIOD = 0.01
CUTOFF = 4.0
FARTHEST = 10.0
"""[s] by which the clocks may be apart."""
LEAST_OVERLAP = 5.0
"""[s] of common time without which nothing is estimated."""
STEEPEST = 30.0
"""[m/s^2] that no truck has."""
LEAST_ACCELERATION = 0.1
"""[m/s^2] in the liveliest part, below which a run says nothing about mass against road load."""
LEAST_SPEED = 0.3
"""[m/s] below which a truck has not travelled."""
LEAST_CORRELATION = 0.7


def clock_ahead(torque: Signal, velocity: Signal) -> float:
    """Time of the torque's clock minus that of the velocity's at the same moment [s].

    Raises LogError where the two logs do not belong together or do not move enough.
    """
    _check_overlap(torque, velocity)
    _check_jumps(velocity)
    _check_motion(velocity)
    grid = even(velocity.start, velocity.end)
    wide = even(velocity.start - FARTHEST, velocity.end + FARTHEST)
    drive = low_pass(on(torque, wide), PERIOD, CUTOFF)
    there = (wide >= torque.start) & (wide <= torque.end)
    acceleration = np.gradient(low_pass(on(velocity, grid), PERIOD, CUTOFF), PERIOD)
    lags, correlation = correlated(drive - drive[there].mean(), there, acceleration)
    best, worst = int(np.argmax(correlation)), int(np.argmin(correlation))
    names = f"{torque.source}, {velocity.source}"
    if -correlation[worst] > max(correlation[best], LEAST_CORRELATION):
        raise LogError(
            f"{names}: torque and acceleration have opposite signs (correlation "
            f"{correlation[worst]:.2f}), one of the two logs has the wrong sign; a positive torque "
            "has to drive the truck forwards, to positive velocity"
        )
    if correlation[best] < LEAST_CORRELATION:
        raise LogError(
            f"{names}: the velocity does not follow the torque (correlation "
            f"{correlation[best]:.2f}, at least {LEAST_CORRELATION} expected); two logs of the "
            f"same run, clocks at most {FARTHEST:g} s apart, are needed"
        )
    return float(lags[best]) + _peak(correlation, best)


def even(first: float, last: float) -> Array:
    """Times from `first` to `last`, PERIOD apart [s]."""
    return first + PERIOD * np.arange(round((last - first) / PERIOD) + 1, dtype=np.float64)


def on(channel: Signal, grid: Array) -> Array:
    """A channel at the times `grid` [s], without what its own rate holds above it."""
    smooth = low_pass(channel.values, channel.period, 0.4 / PERIOD)
    return np.interp(grid, channel.time, smooth)


def correlated(drive: Array, there: Mask, acceleration: Array) -> tuple[Array, Array]:
    """Lags [s], and the correlation of drive(t + lag) with acceleration(t), shape (lags,) each.

    there : where drive was measured; lags at which less than half of what there is to compare
    would be compared have none
    """
    from scipy.signal import correlate

    acceleration = acceleration - float(acceleration.mean())
    drive = np.where(there, drive, 0.0)

    def summed(left: Array, right: Array) -> Array:
        found: Array = correlate(left, right, mode="valid")
        return found

    measured, all_of_it = there.astype(np.float64), np.ones(len(acceleration))
    count = summed(measured, all_of_it)
    power = summed(drive**2, all_of_it) * summed(measured, acceleration**2)
    found = summed(drive, acceleration) / np.sqrt(np.maximum(power, 1e-9 * power.max()))
    lags = PERIOD * np.arange(len(found), dtype=np.float64) - FARTHEST
    return lags, np.where(count > 0.5 * count.max(), found, 0.0)


def _peak(correlation: Array, best: int) -> float:
    """Top of the parabola through the largest value and its neighbours, from there [s]."""
    if not 0 < best < len(correlation) - 1:
        return 0.0
    left, top, right = correlation[best - 1 : best + 2]
    return float(0.5 * PERIOD * (left - right) / (left - 2.0 * top + right))


def _check_overlap(torque: Signal, velocity: Signal) -> None:
    common = min(torque.end, velocity.end) - max(torque.start, velocity.start)
    if common < LEAST_OVERLAP:
        raise LogError(
            f"{torque.source}: {torque.start:g} .. {torque.end:g} s, {velocity.source}: "
            f"{velocity.start:g} .. {velocity.end:g} s; at least {LEAST_OVERLAP:g} s in common "
            "are needed"
        )


def _check_jumps(velocity: Signal) -> None:
    step = np.abs(np.diff(velocity.values))
    step[~(velocity.known[1:] & velocity.known[:-1])] = 0.0
    worst = int(np.argmax(step))
    if step[worst] > 15.0 * noise(velocity.values) + STEEPEST * velocity.period:
        raise LogError(
            f"{velocity.source}: the velocity jumps by {step[worst]:.3g} m/s at "
            f"{velocity.time[worst + 1]:.4g} s; no truck does, use the part before or after it"
        )


def _check_motion(velocity: Signal) -> None:
    smooth = low_pass(velocity.values, velocity.period, 1.0)
    fastest = float(np.abs(smooth).max())
    if fastest < LEAST_SPEED:
        raise LogError(
            f"{velocity.source}: the truck stands, at most {fastest:.2g} m/s; a run with starts "
            "and braking is needed"
        )
    liveliest = float(np.abs(np.diff(smooth)).max() / velocity.period)
    if liveliest < LEAST_ACCELERATION:
        raise LogError(
            f"{velocity.source}: too little excitation, at most {liveliest:.2g} m/s^2; a run with "
            f"starts and braking of {LEAST_ACCELERATION:g} m/s^2 and more is needed"
        )
