"""Holes of a log, bridged so that the simulation goes on through them (pure).

A hole gets regular rows. The rows do not count, but the simulation has to know there what the bench
was asked to do. An input that is curved on both sides goes on as a cubic spline. Any other one is
continued from both sides as straight lines. They meet at the corner that the hole hides. Where they
do not meet within the hole, or the input beside it is noisy, the input is straight. The log tells
how far an input may be off (`INPUT_ERRORS`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import Akima1DInterpolator, CubicSpline

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
# beside it, and so does a curve, if a cubic misses so many times less than a line does there. What
# a cubic misses of noise is 0.85 times what a line misses.
CLEAR = 5.0
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

    A curve is off by what two kinds of splines differ, as the slopes that they begin with do, and
    by the remainder of a cubic, a 384th of the fourth derivative times the length of the hole to
    the fourth. Where the line from one side
    meets neither that of the other nor the sample there, the input may have changed at any time in
    the hole. What changes and changes back in it stays hidden.
    """
    straight = np.interp(at, time, values)
    before = slice(max(0, hole - BESIDE), hole + 1)
    after = slice(hole + 1, hole + 2 + BESIDE)
    if min(len(time[before]), len(time[after])) < 2:
        return straight, HALF * abs(float(values[hole + 1] - values[hole]))
    first = _Line.beside(time, values, before, hole + 1)
    second = _Line.beside(time, values, after, hole)
    rounding = ROUNDING * float(np.ptp(values))
    bend = max(first.bend, second.bend)
    if bend > rounding and max(first.rough, second.rough) <= max(rounding, bend / CLEAR):
        both = slice(before.start, after.stop)
        curve = CubicSpline(time[both], values[both])(at)
        other = Akima1DInterpolator(time[both], values[both])(at)
        length = float(time[hole + 1] - time[hole])
        remainder = abs(second.third - first.third) * length**3 / 384.0
        return curve, float(np.abs(curve - other).max()) + remainder
    meet = (second.line - first.line).roots()
    for corner in meet[(time[hole] < meet) & (meet < time[hole + 1])]:
        bent = np.where(at < corner, first.line(at), second.line(at))
        away = float(np.abs(bent - straight).max())
        if away > CLEAR * max(bend, rounding):
            # Between noisy sides the corner may be a rounded one.
            return bent, HALF * away if bend > rounding else 0.0
    found = min(first.missed, second.missed)
    return straight, found if found > max(bend, rounding) else 0.0


@dataclass(frozen=True)
class _Line:
    """The line through an input on one side of a hole.

    bend : most that it misses there; rough : most that a cubic misses there
    third : third derivative of that cubic
    missed : standard deviation of a straight input that left this line at any time in the hole
    """

    line: Polynomial
    bend: float
    rough: float
    third: float
    missed: float

    @classmethod
    def beside(cls, time: Array, values: Array, side: slice, across: int) -> _Line:
        """The line on this side; across : the sample on the other one."""
        line = Polynomial.fit(time[side], values[side], 1).convert()
        cubic = Polynomial.fit(time[side], values[side], min(3, len(time[side]) - 1))
        bend, rough = (float(np.abs(p(time[side]) - values[side]).max()) for p in (line, cubic))
        third = float(cubic.convert().deriv(3)(0.0))
        return cls(line, bend, rough, third, HALF * abs(float(line(time[across]) - values[across])))
