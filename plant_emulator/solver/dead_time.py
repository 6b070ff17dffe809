"""The reference as it comes out of the drive's dead time b, at the stages of a step.

From the samples of a log, linear on the segment behind each, or from a ring of past references.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.solver.sdirk import GAMMA, SMALLEST_STEP

if TYPE_CHECKING:
    from plant_emulator.model.records import State


def segment_at(tau: float, k: int, time: State) -> int:
    """Segment of the samples that tau lies in, looked for from segment k on."""
    while k + 1 < len(time) and time[k + 1] <= tau:
        k += 1
    while k > 0 and time[k] > tau:
        k -= 1
    return k


def delayed(tau: float, k: int, time: State, value: State, slope: State) -> float:
    """Reference of segment k at the time tau, before the first sample its value [rad/s]."""
    reference: float = value[k] + slope[k] * (max(tau, time[0]) - time[k])
    return reference


def ahead(
    t: float, length: float, b: float, segment: int, time: State, value: State, slope: State
) -> tuple[int, tuple[float, float]]:
    """Segment that the step ends in, and the delayed reference at its stages [rad/s].

    Corners nearer than the smallest step to an end of the step lie at that end.
    """
    early = segment_at(t + max(GAMMA * length, SMALLEST_STEP) - b, segment, time)
    segment = segment_at(t + max(length - SMALLEST_STEP, SMALLEST_STEP) - b, early, time)
    return segment, (
        delayed(t + GAMMA * length - b, early, time, value, slope),
        delayed(t + length - b, segment, time, value, slope),
    )


def past(lag: float, newest: int, history: State) -> float:
    """Reference that many steps ago, linear between the steps [rad/s]."""
    length = len(history)
    whole = int(lag)
    part = lag - whole
    young: float = history[(newest - whole) % length]
    old: float = history[(newest - whole - 1) % length]
    return (1.0 - part) * young + part * old
