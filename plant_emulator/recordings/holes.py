"""Holes of a log, bridged so that the simulation goes on through them (pure).

A hole gets regular rows. The rows do not count, but the simulation has to know there what the bench
was asked to do. Each input is continued from both sides as straight lines. They meet at the corner
that the hole hides. Where they do not meet within the hole, or the input beside it is noisy, the
input is straight. An input that is curved goes on as a cubic spline, where that is less uncertain.
The log tells how far an input may be off (`INPUT_ERRORS`).
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

    What changes and changes back in the hole stays hidden.
    """
    before = slice(max(0, hole - BESIDE), hole + 1)
    after = slice(hole + 1, hole + 2 + BESIDE)
    straight = np.interp(at, time, values)
    if min(len(time[before]), len(time[after])) < 2:
        return straight, HALF * abs(float(values[hole + 1] - values[hole]))
    first = _Side.of(time, values, before, hole + 1)
    second = _Side.of(time, values, after, hole)
    rounding = ROUNDING * float(np.ptp(values))
    found = _straight(first, second, at, straight, rounding)
    bend = max(first.bend, second.bend)
    if bend <= rounding or max(first.rough, second.rough) > max(rounding, bend / CLEAR):
        return found
    curved = _curve(time, values, (before, after), at, abs(second.third - first.third))
    error = max(curved[1], min(first.cubic_missed, second.cubic_missed))
    return (curved[0], error) if error < found[1] else found


def _straight(
    first: _Side, second: _Side, at: Array, straight: Array, rounding: float
) -> tuple[Array, float]:
    """The corner of the lines from both sides, or else the straight input, and its deviation.

    Where the line from one side meets neither that of the other nor the sample there, the input may
    have changed at any time in the hole. The chord of a parabola misses 3/4 w^2 of what a line
    misses beside the hole, with w the hole over the length of the side.
    """
    bend, (start, end) = max(first.bend, second.bend), (first.end, second.end)
    for corner in map(float, np.real((second.line - first.line).roots())):
        if not start < corner < end:
            continue
        bent = np.where(at < corner, first.line(at), second.line(at))
        away = float(np.abs(bent - straight).max())
        if away > CLEAR * max(bend, rounding):
            # Between sides that are not straight the corner may be a rounded one.
            return bent, HALF * away if bend > rounding else 0.0
    missed = min(first.missed, second.missed)
    if missed > max(bend, rounding) or bend <= rounding:
        return straight, missed if missed > rounding else 0.0
    wide = (end - start) / min(first.length, second.length)
    return straight, min(missed, 0.75 * wide**2 * bend)


def _curve(
    time: Array, values: Array, sides: tuple[slice, slice], at: Array, change: float
) -> tuple[Array, float]:
    """The input as a cubic spline through both sides, and its standard deviation.

    It is off by what two kinds of splines differ, as the slopes that they begin with do, and by the
    remainder of a cubic, a 384th of the fourth derivative times the length of the hole to the
    fourth.

    change : of the third derivative over the hole
    """
    both = slice(sides[0].start, sides[1].stop)
    curve = CubicSpline(time[both], values[both])(at)
    other = Akima1DInterpolator(time[both], values[both])(at)
    length = float(time[sides[1].start] - time[sides[0].stop - 1])
    return curve, float(np.abs(curve - other).max()) + change * length**3 / 384.0


@dataclass(frozen=True)
class _Side:
    """An input on one side of a hole, as a line and as a cubic.

    end : last time before the hole, or first one behind it [s]; length : of the side [s]
    bend, rough : most that the line and the cubic miss here
    third : third derivative of the cubic
    missed, cubic_missed : what an input misses in the mean that left the line, or the cubic, at any
        time in the hole for the sample across
    """

    line: Polynomial
    end: float
    length: float
    bend: float
    rough: float
    third: float
    missed: float
    cubic_missed: float

    @classmethod
    def of(cls, time: Array, values: Array, side: slice, across: int) -> _Side:
        """The input on this side; across : the sample on the other one."""
        own = time[side]
        line = Polynomial.fit(own, values[side], 1).convert()
        # A cubic through four samples would tell nothing of their noise.
        cubic = Polynomial.fit(own, values[side], 3 if len(own) > 4 else 1)
        bend, rough = (float(np.abs(p(own) - values[side]).max()) for p in (line, cubic))
        missed, cubic_missed = (
            HALF * abs(float(p(time[across]) - values[across])) for p in (line, cubic)
        )
        return cls(
            line=line,
            end=float(own[np.argmin(np.abs(own - time[across]))]),
            length=float(np.ptp(own)),
            bend=bend,
            rough=rough,
            third=float(cubic.deriv(3)(own[0])),
            missed=missed,
            cubic_missed=cubic_missed,
        )
