"""A sensor that stands still to the last bit while what belongs to it moves (pure)."""

from dataclasses import dataclass, replace
from math import inf

STUCK = 20
"""Samples in a row without a change. The noise of a sound sensor shows in every sample."""
SETTLED, LATE = 3, 3
"""Samples by which the partner may move after the sensor has settled, and before it follows. At
steady speed a sensor without noise shows one value for seconds."""


@dataclass(frozen=True, kw_only=True)
class Streak:
    """Readings of one sensor in a row that are equal, and the range of what belongs to it.

    late : count of the readings since its partner has visibly moved
    """

    value: float
    count: int
    lowest: float = inf
    highest: float = -inf
    late: int = 0


def follow(before: Streak | None, value: float, partner: float, visible: float) -> Streak:
    """Streak after one more sample; a sound sensor shows a move of `visible` in its partner.

    The first samples do not count, because the partner still moves when the sensor has settled.
    """
    if before is None or value != before.value:
        return Streak(value=value, count=1)
    if before.count < SETTLED:
        return replace(before, count=before.count + 1)
    lowest, highest = min(before.lowest, partner), max(before.highest, partner)
    late = before.late + (highest - lowest > visible)
    return replace(before, count=before.count + 1, lowest=lowest, highest=highest, late=late)


def is_stuck(streak: Streak | None, nothing: float) -> bool:
    """Whether a sensor stands still long after its partner has moved, at more than `nothing`."""
    if streak is None or streak.count < STUCK or abs(streak.value) <= nothing:
        return False
    return streak.late > LATE
