"""When a contest takes one more effect, and when it looks for no more."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.explain import MISFIT, THRESHOLD, excess, weighed

if TYPE_CHECKING:
    from plant_emulator.diagnosis.contest import Point

# Share of the gap that a further effect has to close to be named.
FURTHER = 0.04
# Share of what the effects before leave that a further one has to close.
REST = 0.75
# Share of the gap that is too little to look for more.
LITTLE = 0.04
# Share of the gap that the first of two effects closes at least.
PART = 0.2


def enough(final: Point, null: Point, reaches_noise: bool) -> bool:
    """Whether to look for no further effect: there is little left for it, or far too much."""
    if not final.effects:
        return False
    left, gap = excess(final), excess(null)
    too_much = reaches_noise and left > (1.0 - PART) * gap
    noise = not reaches_noise or final.chi_squared <= MISFIT
    return too_much or (noise and left <= max(LITTLE * gap, THRESHOLD))


def counts(best: Point, base: Point, null: Point, reaches_noise: bool) -> bool:
    """Whether one more effect earns its place."""
    fall = base.cost - best.cost
    evident = weighed(fall, best, null) > THRESHOLD
    if not reaches_noise:
        return evident
    further = excess(null) > THRESHOLD and fall > FURTHER * excess(null)
    if base.effects:  # what a law slightly other than the library's leaves is no second effect
        most_of_the_rest = fall > REST * (base.squares - base.samples)
        large = further or base.chi_squared > MISFIT
        return fall > THRESHOLD and large and most_of_the_rest
    # The first of several effects leaves a correlated rest: it is judged by the gap as well.
    return evident or (fall > THRESHOLD and further)
