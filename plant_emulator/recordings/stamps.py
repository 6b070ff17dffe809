"""Corrects sampling jitter: the reference shows when each row was taken (pure).

Rows may be taken a little early or late and yet be stamped regularly.

A drive's reference is smooth between its corners: straight, or bent slowly. A row that was taken
late shows a reference further along, so on a slope its departure from a local line, over the slope,
is how late it was. All channels of a row were taken together, so one corrected stamp serves all.
Where the reference stands still no departure shows. What is not known of a row's time is noise of
all its channels, in proportion to their rates of change (`recording`). A log whose reference tells
nothing has the jitter of the others, because the same logger took the rows of all.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import KNEE_TIME, TIMING_ERROR, has_truck
from plant_emulator.signals.noise import deviation_without_outliers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array, Log

# Half widths of windows [samples] by the degree of their local polynomial: long straight ones tell
# best, short ones where the reference has corners, and bent ones where it is a wave.
HALF_WIDTHS = {1: (20, 8), 4: (30, 20, 14, 9)}
# Departures of a window over the log's jitter up to which the polynomial follows the reference: so
# many standard deviations of such a variance.
LARGEST_CHANCE = 2.0
# Times that the jitter is taken from the chosen windows; the last time changes it little.
PASSES = 3
# What moves a reference on its slopes, over the logger's jitter there, from which on noise moves it
# as much [1].
NOISY = 2.0**0.5
# A slope that tells a row's time [rad/s^2], and the least jitter worth correcting [s].
TELLING_SLOPE, LEAST_JITTER = 10.0, 2e-4
# Rows that tell nothing of a jitter.
FEW_ROWS = 60
# A departure from the usual interval that no jitter makes [intervals].
LARGEST_DEPARTURE = 0.4


def restamp_all(logs: Sequence[Log], fitted: int | None = None) -> list[tuple[Log, float]]:
    """The logs of one logger, each corrected, with the deviation of its jitter [s].

    A log whose reference tells nothing has the jitter of the others.
    fitted : so many logs, the first ones, tell the jitter of all; None: all of them do
    """
    found = [restamp(log) for log in logs]
    # Knees bear the stamps of the PLC: they tell nothing of a logger.
    told = [own for log, own in found[:fitted] if own is not None and KNEE_TIME not in log]
    others = float(np.median(told)) if told else 0.0
    if others < LEAST_JITTER:
        others = 0.0
    return [
        (_beside_jitter(log, others), others) if own is None else (log, own) for log, own in found
    ]


def _beside_jitter(log: Log, jitter: float) -> Log:
    """A log whose rows stay on their stamps, with this jitter [s].

    Rows that were read between the steps of a staircase, by interpolation, show its values of other
    times. Where the jitter explains how the reference moves on its slopes, it is put back on its
    stamps. It stays where noise moves it more (that of a torque sensor, by a regulator).
    """
    if jitter == 0.0:
        return log
    time, reference = log.time, log["speed_reference"]
    slope = np.abs(np.gradient(reference, time))
    telling = slope > TELLING_SLOPE
    if telling.sum() >= FEW_ROWS:
        # White noise has third differences of sqrt(20) times its deviation.
        differences = np.diff(reference, 3)[telling[1:-2]]
        moved = deviation_without_outliers(differences) / 20.0**0.5
        if moved < NOISY * jitter * np.median(slope[telling]):
            late, _ = lateness(time, reference)
            reference = np.interp(time, time + late, reference)
    uncertain = _uncertain(log, jitter)
    return replace(uncertain, signals={**uncertain.signals, "speed_reference": reference})


def _uncertain(log: Log, deviation: float | Array) -> Log:
    """The log with this deviation of the times of its rows [s]."""
    errors = np.broadcast_to(deviation, log.time.shape)
    return replace(log, signals={**log.signals, TIMING_ERROR: errors})


def restamp(log: Log) -> tuple[Log, float | None]:
    """The log with its rows at the times that its reference shows, and the jitter's deviation [s].

    It then tells how uncertain these times are. A log with knees between its samples bears the
    stamps of the PLC itself and has no jitter.
    None: the reference tells nothing, as a staircase does (a log with a truck); the log stays.
    """
    if KNEE_TIME in log:
        return log, 0.0
    if has_truck(log) or len(log.time) < FEW_ROWS:
        return log, None
    late, leverage = lateness(log.time, log["speed_reference"])
    told = leverage < 1.0
    if told.sum() < FEW_ROWS:
        return log, None
    # Without outliers: at corners that a window does not miss a line departs, jittered or not.
    deviation = deviation_without_outliers(late[told])
    if deviation < LEAST_JITTER:
        return log, 0.0
    uncertain = _uncertain(log, deviation * np.sqrt(leverage))
    return replace(uncertain, time=log.time + late), deviation


def lateness(time: Array, reference: Array) -> tuple[Array, Array]:
    """Timing error of every row [s], and its leverage in the fit [1], shape (n,) each.

    By least squares over windows around, before or behind a row: of those that depart from the
    reference no more than the jitter does, the one of least leverage.
    The leverage is the diagonal of the hat matrix (D. Hoaglin, R. Welsch, American Statistician 32
    (1978) 17). The jitter of the window's rows moves the fit: the timing error is uncertain by that
    share of the jitter's variance. It is 1 where the reference tells nothing.
    """
    n, interval = len(time), float(np.median(np.diff(time)))
    windows = [
        (first, first + 2 * half, degree)
        for degree, halves in HALF_WIDTHS.items()
        for half in halves
        for first in (-half, -2 * half, 0)
    ]
    spreads = np.full((len(windows), n), np.inf)
    rates, departures = np.zeros((2, len(windows), n))
    leverages, freedoms = np.ones((2, len(windows), 1))
    for k, (first, last, degree) in enumerate(windows):
        freedoms[k] = last - first - degree
        if last - first >= n:
            continue
        offsets = interval * np.arange(first, last + 1)
        basis = np.stack([offsets**power for power in range(degree + 1)], axis=1)
        inverse = np.linalg.pinv(basis)
        leverages[k] = basis[-first] @ inverse[:, -first]
        rows = np.arange(-first, n - last)
        values = reference[rows[:, None] + np.arange(first, last + 1)]
        found = values @ inverse.T
        left = values - found @ basis.T
        powers = np.arange(1, degree + 1)
        slope = (found[:, 1:] * powers) @ (offsets ** (powers[:, None] - 1))
        moved = left / np.hypot(slope, TELLING_SLOPE)
        # The row itself by its slope, so that neighbours cannot change places.
        moved[:, -first] = left[:, -first] / np.maximum(np.abs(slope[:, -first]), TELLING_SLOPE)
        regular = np.max(np.abs(moved), axis=1) < LARGEST_DEPARTURE * interval
        spread = np.sqrt(np.sum(moved**2, axis=1) / freedoms[k])
        spreads[k, rows[regular]] = spread[regular]
        rates[k, rows], departures[k, rows] = slope[:, -first], left[:, -first]
    best, places = spreads.min(axis=0), np.arange(n)
    chosen = np.argmin(spreads, axis=0)
    for _ in range(PASSES):
        told = np.isfinite(best) & (np.abs(rates[chosen, places]) > TELLING_SLOPE)
        jitter = np.median(spreads[chosen, places][told]) if told.any() else 0.0
        largest = jitter * np.sqrt(1.0 + LARGEST_CHANCE * np.sqrt(2.0 / freedoms))
        chosen = np.where(spreads <= np.maximum(largest, best), leverages, np.inf).argmin(axis=0)
    rate = rates[chosen, places]
    told = np.isfinite(best) & (np.abs(rate) > TELLING_SLOPE)
    late = departures[chosen, places] / np.where(told, rate, np.inf)
    return late, np.where(told, leverages[chosen, 0], 1.0)
