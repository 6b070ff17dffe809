"""Corrects sampling jitter: the reference shows when each row was taken (pure).

Rows may be taken a little early or late and yet be stamped regularly.

A drive's reference is smooth between its corners: straight, or bent slowly. A row that was taken
late shows a reference further along, so on a slope its departure from a local line, over the slope,
is how late it was. All channels of a row were taken together, so one corrected stamp serves all.
Where the reference stands still no departure shows. What is not known of a row's time is noise of
all its channels, in proportion to their rates of change (`recording`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import KNEE_TIME, TIMING_ERROR
from plant_emulator.signals.noise import deviation_without_outliers

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array, Log

# Windows of a local polynomial: first and last sample beside a row, and its degree. Long straight
# ones tell best, and short or bent ones where the reference is.
WINDOWS = (
    (-20, 20, 1),
    (-40, 0, 1),
    (0, 40, 1),
    (-8, 8, 1),
    (-16, 0, 1),
    (0, 16, 1),
    (-10, 10, 2),
    (-20, 0, 2),
    (0, 20, 2),
)
# A window's departures over those of the best one, up to which it is as good.
AS_GOOD = 1.3
# A slope that tells a row's time [rad/s^2], and the least jitter worth correcting [s].
TELLING_SLOPE, LEAST_JITTER = 10.0, 2e-4
# Rows that tell nothing of a jitter.
FEW_ROWS = 60
# A departure from the usual interval that no jitter makes [intervals].
LARGEST_DEPARTURE = 0.4


def restamp(log: Log) -> tuple[Log, float]:
    """The log with its rows at the times that its reference shows, and the jitter's deviation [s].

    It then tells how uncertain these times are. A staircase (a log with a truck) tells nothing and
    stays as it is. So does one with knees between its samples, which bears the stamps of the PLC
    itself.
    """
    if "wheel_torque" in log or KNEE_TIME in log or len(log.time) < FEW_ROWS:
        return log, 0.0
    late, leverage = lateness(log.time, log["speed_reference"])
    told = leverage < 1.0
    if told.sum() < FEW_ROWS:
        return log, 0.0
    # Without outliers: at corners that a window does not miss a line departs, jittered or not.
    deviation = deviation_without_outliers(late[told])
    if deviation < LEAST_JITTER:
        return log, 0.0
    signals = {**log.signals, TIMING_ERROR: deviation * np.sqrt(leverage)}
    return replace(log, time=log.time + late, signals=signals), deviation


def lateness(time: Array, reference: Array) -> tuple[Array, Array]:
    """Timing error of every row [s], and its leverage in the fit [1], shape (n,) each.

    By least squares over windows around, before or behind a row: the first of those that fit best.
    The leverage is the diagonal of the hat matrix (D. Hoaglin, R. Welsch, American Statistician 32
    (1978) 17). The jitter of the window's rows moves the fit: the timing error is uncertain by that
    share of the jitter's variance. It is 1 where the reference tells nothing.
    """
    n, interval = len(time), float(np.median(np.diff(time)))
    spreads = np.full((len(WINDOWS), n), np.inf)
    moves = np.zeros((len(WINDOWS), n))
    leverages = np.ones(len(WINDOWS))
    for k, (first, last, degree) in enumerate(WINDOWS):
        if last - first >= n:
            continue
        offsets = np.arange(first, last + 1)
        basis = np.stack([offsets**power for power in range(degree + 1)], axis=1).astype(float)
        inverse = np.linalg.pinv(basis)
        leverages[k] = basis[-first] @ inverse[:, -first]
        rows = np.arange(-first, n - last)
        found = reference[rows[:, None] + offsets] @ inverse.T
        left = reference[rows[:, None] + offsets] - found @ basis.T
        rate = found[:, 1:2] + sum(
            power * found[:, power : power + 1] * offsets ** (power - 1)
            for power in range(2, degree + 1)
        )
        steep = np.min(np.abs(rate), axis=1) > TELLING_SLOPE * interval
        moved = interval * left / np.where(rate == 0.0, np.inf, rate)
        regular = steep & (np.max(np.abs(moved), axis=1) < LARGEST_DEPARTURE * interval)
        freedom = len(offsets) - degree - 1
        spread = np.sqrt(np.sum(moved**2, axis=1) / freedom)
        spreads[k, rows[regular]] = spread[regular]
        moves[k, rows] = moved[:, -first]
    best = spreads.min(axis=0)
    chosen = np.argmax(spreads <= AS_GOOD * best + 1e-9, axis=0)
    told = np.isfinite(best)
    late = np.where(told, moves[chosen, np.arange(n)], 0.0)
    return late, np.where(told, leverages[chosen], 1.0)
