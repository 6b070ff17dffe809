"""Holes of a log, bridged so that the simulation goes on through them (pure).

A hole gets regular rows. The rows do not count, but the simulation has to know there what the bench
was asked to do. Each input is continued from both sides as straight lines. They meet at the corner
that the hole hides. Where they do not meet within the hole, or the input beside it is curved or
noisy, the input is straight, and the log tells how far it may be off (`INPUT_ERRORS`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import Polynomial

from plant_emulator.signals.log import INPUT_ERRORS, KNEE_TIME, KNEES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array, Log

    Use = Mapping[str, NDArray[np.bool_]]

# A hole of this many usual intervals gets rows: a single lost row may have been a corner, and a
# corner that comes late looks like a dead time that varies. Where the log itself tells the corners
# between its samples, a hole gets rows from the second length on. Rows that are each 0.35 intervals
# off their time leave no hole.
SHORTEST_HOLE, SHORTEST_WITH_KNEES = 1.75, 5.5
# Intervals beside a hole that its lines are laid through.
BESIDE = 10
# Lines count that differ from the straight input in the hole by so many times what they miss
# beside it. Beside a parabola that is 1.7 times in one lost row, and 4.2 times in five.
STRAIGHT = 5.0
# What a line misses of the sample across, over what it would miss of a parabola: more is no curve.
CURVED = 1.5
# Rounding of an input over its range [1]: it tells of no bend.
ROUNDING = 1e-6
# Mean error of a straight input that kept its course to the end of the hole, or left it at once,
# over what that course misses.
HALF = 0.5


def bridge_holes(log: Log, use: Use) -> tuple[Log, Use]:
    """Give a log and its samples that count with rows in the holes; the rows do not count."""
    time = log.time
    interval = float(np.median(np.diff(time)))
    shortest = SHORTEST_WITH_KNEES if KNEE_TIME in log else SHORTEST_HOLE
    holes = np.flatnonzero(np.diff(time) > shortest * interval)
    if len(holes) == 0:
        return log, use
    inserted = np.concatenate([_regular(time[k], time[k + 1], interval) for k in holes])
    order = np.argsort(np.concatenate([time, inserted]), kind="stable")
    whole = np.concatenate([time, inserted])[order]
    logged = order < len(time)
    signals = {name: np.interp(whole, time, values) for name, values in log.signals.items()}
    for name, error in INPUT_ERRORS.items():
        if name not in log:
            continue
        signals[error] = np.zeros(len(whole))
        for k in holes:
            within = (whole > time[k]) & (whole < time[k + 1])
            signals[name][within], signals[error][within] = _continue_input(
                time, log[name], int(k), whole[within]
            )
    for knee_time, _ in KNEES:
        if knee_time in log:  # a knee of 0 s is none: the reference is straight in the hole
            signals[knee_time][~logged] = 0.0
    counted = {}
    for name, own in use.items():
        counted[name] = np.zeros(len(whole), bool)
        counted[name][logged] = own
    return replace(log, time=whole, signals=signals), counted


def _regular(first: float, last: float, interval: float) -> Array:
    """Times inside a hole [s], about an interval apart."""
    count = max(1, round((last - first) / interval) - 1)
    return np.linspace(first, last, count + 2)[1:-1]


def _continue_input(time: Array, values: Array, hole: int, at: Array) -> tuple[Array, float]:
    """An input in the hole behind a sample, at these times, and its standard deviation there.

    Where the line from one side meets neither that of the other nor the sample there, the input may
    have changed at any time in the hole. What changes and changes back in it stays hidden.
    """
    straight = np.interp(at, time, values)
    before = slice(max(0, hole - BESIDE), hole + 1)
    after = slice(hole + 1, hole + 2 + BESIDE)
    if min(len(time[before]), len(time[after])) < 2:
        return straight, HALF * abs(float(values[hole + 1] - values[hole]))
    first = _Line.beside(time, values, before, hole + 1)
    second = _Line.beside(time, values, after, hole)
    bend = max(first.bend, second.bend)
    meet = (second.line - first.line).roots()
    for corner in meet[(time[hole] < meet) & (meet < time[hole + 1])]:
        bent = np.where(at < corner, first.line(at), second.line(at))
        away = float(np.abs(bent - straight).max())
        if away > STRAIGHT * bend:
            # A rounded corner lies between the two.
            return bent, HALF * away if bend > ROUNDING * np.ptp(values) else 0.0
    return straight, min(first.error, second.error)


@dataclass(frozen=True)
class _Line:
    """The line through an input on one side of a hole.

    bend : most that it misses there
    error : standard deviation of a straight input in the hole, as far as this side tells
    """

    line: Polynomial
    bend: float
    error: float

    @classmethod
    def beside(cls, time: Array, values: Array, side: slice, across: int) -> _Line:
        """The line on this side; across : the sample on the other one.

        A parabola misses 6 (1/2 + w)^2 - 1/2 bends of the sample across, and its chord 3/4 w^2
        bends of the parabola, with w the hole over the length of the side.
        """
        line = Polynomial.fit(time[side], values[side], 1).convert()
        bend = max(np.abs(line(time[side]) - values[side]).max(), ROUNDING * np.ptp(values))
        missed = HALF * abs(line(time[across]) - values[across])
        wide = np.abs(time[side] - time[across]).min() / np.ptp(time[side])
        curved = HALF * CURVED * (6.0 * (0.5 + wide) ** 2 - 0.5) * bend
        error = missed if missed > curved else min(missed, 0.75 * wide**2 * bend)
        if bend <= ROUNDING * np.ptp(values) and missed <= curved:
            error = 0.0
        return cls(line, float(bend), float(error))
