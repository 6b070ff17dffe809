"""The delayed reference: the reference after the drive's dead time b, at the stages of a step.

It is read from the samples of a log, linear between them, or from a ring of past references.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.solver.sdirk import GAMMA, MIDDLE, SMALLEST_STEP

if TYPE_CHECKING:
    from plant_emulator.model.records import State


def segment_at(tau: float, k: int, time: State) -> int:
    """Index of the segment between samples that holds the time tau; the search begins at k."""
    while k + 1 < len(time) and time[k + 1] <= tau:
        k += 1
    while k > 0 and time[k] > tau:
        k -= 1
    return k


def reference_at(tau: float, k: int, time: State, value: State, slope: State) -> float:
    """Reference of segment k at the time tau [rad/s]; before the first sample, that sample's."""
    reference: float = value[k] + slope[k] * (max(tau, time[0]) - time[k])
    return reference


def stage_references(
    t: float, length: float, b: float, segment: int, time: State, value: State, slope: State
) -> tuple[int, tuple[float, float, float]]:
    """Segment at the end of a step, and the delayed reference at its three stages [rad/s].

    A corner that is closer than the smallest step to an end of the step is taken to lie there.

    t, length : begin and length of the step [s]; b : dead time [s]
    segment : where the search for the segment begins
    """
    early = segment_at(t + max(GAMMA * length, SMALLEST_STEP) - b, segment, time)
    middle = segment_at(t + max(MIDDLE * length, SMALLEST_STEP) - b, early, time)
    segment = segment_at(t + max(length - SMALLEST_STEP, SMALLEST_STEP) - b, middle, time)
    return segment, (
        reference_at(t + GAMMA * length - b, early, time, value, slope),
        reference_at(t + MIDDLE * length - b, middle, time, value, slope),
        reference_at(t + length - b, segment, time, value, slope),
    )


def past_reference(lag: float, newest: int, history: State) -> float:
    """Reference `lag` steps before the newest one [rad/s], linear between the steps."""
    length = len(history)
    whole = int(lag)
    part = lag - whole
    young: float = history[(newest - whole) % length]
    old: float = history[(newest - whole - 1) % length]
    return (1.0 - part) * young + part * old
