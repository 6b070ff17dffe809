"""How far the two loggers' clocks are apart, to start from, and whether the two logs fit (pure).

A motor's torque and the truck's acceleration have nearly the same shape. Their cross-correlation
has its peak where one clock is shifted onto the other; what the logs are of (another run, a wrong
sign, a constant speed) shows in the peak, before anything is fitted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.road_signal import low_pass

if TYPE_CHECKING:
    from plant_emulator.log import Array
    from plant_emulator.road_signal import Signal

PERIOD = 0.01
CUTOFF = 4.0
FARTHEST = 10.0
"""[s] by which the clocks may be apart."""
LEAST_OVERLAP = 5.0
"""[s] of common time without which nothing is estimated."""
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
    _check_motion(velocity)
    begin = min(torque.start, velocity.start)
    grid = even(begin, max(torque.end, velocity.end))
    drive = low_pass(on(torque, grid), PERIOD, CUTOFF)
    acceleration = np.gradient(low_pass(on(velocity, grid), PERIOD, CUTOFF), PERIOD)
    lags, correlation = correlated(drive, acceleration)
    best, worst = int(np.argmax(correlation)), int(np.argmin(correlation))
    names = f"{torque.source}, {velocity.source}"
    if -correlation[worst] > max(correlation[best], LEAST_CORRELATION):
        raise LogError(
            f"{names}: torque and acceleration have opposite signs (correlation "
            f"{correlation[worst]:.2f}); a positive torque has to drive the truck forwards"
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


def correlated(drive: Array, acceleration: Array) -> tuple[Array, Array]:
    """Lags [s], and the correlation of drive(t + lag) with acceleration(t), shape (lags,) each."""
    from scipy.signal import correlate

    count = round(FARTHEST / PERIOD)
    drive = np.pad(drive - drive.mean(), count)
    acceleration = acceleration - acceleration.mean()
    scale = np.linalg.norm(drive) * np.linalg.norm(acceleration)
    found: Array = correlate(drive, acceleration, mode="valid") / scale
    return even(-FARTHEST, FARTHEST), found


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
