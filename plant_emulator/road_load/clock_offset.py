"""First estimate of the offset between two loggers' clocks, and checks of the two logs (pure).

The motor's torque and the truck's acceleration have nearly the same shape. The lag of the largest
cross-correlation is the offset between the clocks. The height of this peak shows logs of different
runs, a wrong sign or a constant speed before any fit.
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
"""Time step of the correlation [s]."""
CUTOFF = 4.0
"""Cutoff of both signals before the correlation [Hz]."""
FARTHEST = 10.0
"""Largest offset between the clocks [s]."""
LEAST_OVERLAP = 5.0
"""Shortest common time of both logs [s]."""
STEEPEST = 30.0
"""Acceleration that no truck reaches [m/s^2]."""
LEAST_ACCELERATION = 0.1
"""Smallest peak acceleration [m/s^2] that separates mass from road load."""
LEAST_SPEED = 0.3
"""Smallest peak speed of a truck that travelled [m/s]."""
LEAST_CORRELATION = 0.7
"""Smallest correlation of torque and acceleration in one run [1]."""


def clock_ahead(torque: Signal, velocity: Signal) -> float:
    """Time on the torque's clock minus time on the velocity's clock at the same moment [s].

    Raises LogError if the logs do not belong together, or if the truck moves too little.
    """
    _check_overlap(torque, velocity)
    _check_jumps(velocity)
    _check_motion(velocity)
    grid = even_times(velocity.start, velocity.end)
    wide = even_times(velocity.start - FARTHEST, velocity.end + FARTHEST)
    drive = low_pass(resample(torque, wide), PERIOD, CUTOFF)
    measured = (wide >= torque.start) & (wide <= torque.end)
    acceleration = np.gradient(low_pass(resample(velocity, grid), PERIOD, CUTOFF), PERIOD)
    lags, correlation = correlate(drive - drive[measured].mean(), measured, acceleration)
    best, worst = int(np.argmax(correlation)), int(np.argmin(correlation))
    names = f"{torque.source}, {velocity.source}"
    if -correlation[worst] > max(correlation[best], LEAST_CORRELATION):
        raise LogError(
            f"{names}: torque and acceleration have opposite signs (correlation "
            f"{correlation[worst]:.2f}), one of the two logs has the wrong sign; a positive torque "
            "has to drive the truck forwards, with a positive velocity"
        )
    if correlation[best] < LEAST_CORRELATION:
        raise LogError(
            f"{names}: the velocity does not follow the torque (correlation "
            f"{correlation[best]:.2f}, at least {LEAST_CORRELATION} expected); two logs of the "
            f"same run, clocks at most {FARTHEST:g} s apart, are needed"
        )
    return float(lags[best]) + _refine_peak(correlation, best)


def even_times(first: float, last: float) -> Array:
    """Times from `first` to `last` in steps of PERIOD [s]."""
    return first + PERIOD * np.arange(round((last - first) / PERIOD) + 1, dtype=np.float64)


def resample(channel: Signal, grid: Array) -> Array:
    """Values of a channel at the times `grid` [s], after a low pass against aliasing."""
    smooth = low_pass(channel.values, channel.period, 0.4 / PERIOD)
    return np.interp(grid, channel.time, smooth)


def correlate(drive: Array, measured: Mask, acceleration: Array) -> tuple[Array, Array]:
    """Lags [s] and correlation of drive(t + lag) with acceleration(t) [1], shape (lags,) each.

    measured : where drive was measured
    The correlation is 0 at lags with less than half of the largest number of compared samples.
    """
    from scipy import signal

    acceleration = acceleration - float(acceleration.mean())
    drive = np.where(measured, drive, 0.0)

    def sums(left: Array, right: Array) -> Array:
        found: Array = signal.correlate(left, right, mode="valid")
        return found

    weight, ones = measured.astype(np.float64), np.ones(len(acceleration))
    count = sums(weight, ones)
    power = sums(drive**2, ones) * sums(weight, acceleration**2)
    found = sums(drive, acceleration) / np.sqrt(np.maximum(power, 1e-9 * power.max()))
    lags = PERIOD * np.arange(len(found), dtype=np.float64) - FARTHEST
    return lags, np.where(count > 0.5 * count.max(), found, 0.0)


def _refine_peak(correlation: Array, best: int) -> float:
    """Distance of the parabola's vertex through the peak and its neighbours from the peak [s]."""
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
    step[~(velocity.valid[1:] & velocity.valid[:-1])] = 0.0
    worst = int(np.argmax(step))
    if step[worst] > 15.0 * noise(velocity.values) + STEEPEST * velocity.period:
        raise LogError(
            f"{velocity.source}: the velocity jumps by {step[worst]:.3g} m/s at "
            f"{velocity.time[worst + 1]:.4g} s; no truck can; use the part before or after it"
        )


def _check_motion(velocity: Signal) -> None:
    smooth = low_pass(velocity.values, velocity.period, 1.0)
    fastest = float(np.abs(smooth).max())
    if fastest < LEAST_SPEED:
        raise LogError(
            f"{velocity.source}: the truck stands, at most {fastest:.2g} m/s; a run with starts "
            "and braking is needed"
        )
    largest = float(np.abs(np.diff(smooth)).max() / velocity.period)
    if largest < LEAST_ACCELERATION:
        raise LogError(
            f"{velocity.source}: too little excitation, at most {largest:.2g} m/s^2; a run with "
            f"starts and braking of {LEAST_ACCELERATION:g} m/s^2 and more is needed"
        )
