"""Holes of a log, bridged so that the simulation goes on through them (pure).

A hole gets regular rows. The rows do not count, but the simulation has to know there what the bench
was asked to do. The reference is continued from both sides as straight lines. They meet at the
corner that the hole hides. Where they do not meet within the hole, or the reference beside it is
curved, the reference is straight.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import KNEE_TIME, KNEES

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
# Lines count that differ from the straight reference in the hole by so many times what they miss
# beside it. Beside a parabola that is 1.7 times in one lost row, and 4.2 times in five.
STRAIGHT = 5.0


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
    if "wheel_torque" not in log:
        for k in holes:
            within = (whole > time[k]) & (whole < time[k + 1])
            reference = log["speed_reference"]
            signals["speed_reference"][within] = _continue_reference(
                time, reference, int(k), whole[within]
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


def _continue_reference(time: Array, reference: Array, hole: int, at: Array) -> Array:
    """The reference in the hole behind a sample, at these times."""
    before = slice(max(0, hole - BESIDE), hole + 1)
    after = slice(hole + 1, hole + 2 + BESIDE)
    start, end = time[hole], time[hole + 1]
    if min(len(time[before]), len(time[after])) < 2:
        return np.interp(at, time, reference)
    first = np.polyfit(time[before] - start, reference[before], 1)
    second = np.polyfit(time[after] - start, reference[after], 1)
    turn = first[0] - second[0]
    corner = (second[1] - first[1]) / turn if turn != 0.0 else -1.0
    if not 0.0 < corner < end - start:
        return np.interp(at, time, reference)
    since, straight = at - start, np.interp(at, time, reference)
    line = np.where(since < corner, np.polyval(first, since), np.polyval(second, since))
    bend = max(
        float(np.abs(np.polyval(own, time[side] - start) - reference[side]).max())
        for own, side in ((first, before), (second, after))
    )
    return np.asarray(line if np.abs(line - straight).max() > STRAIGHT * bend else straight)
