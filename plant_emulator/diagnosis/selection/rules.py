"""When a contest takes one more effect, and when it looks for no more."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import (
    EVIDENCE_THRESHOLD,
    LJUNG_BOX_LIMIT,
    NOISE_MEAN_SQUARE,
    UNEXPLAINED_SHARE,
    evidence_of,
    excess,
)

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult

# More effects than that at once explain anything.
MOST_EFFECTS = 2
# Share of the gap that a first effect closes that is named without its evidence.
PART_OF_GAP = 0.04
# Evidence of a second effect where either leaves nothing but noise: one with angles of its own in
# every run came to 40 by chance.
SECOND = 60.0
# And the share of the whole gap that the first's own law may have left: the square of an error of
# 3 % in it.
LAW = 0.001
# Evidence of a second effect that may be depth of a hollow: fits stopped 300 and 450 above the
# bottom, while all that they left was noise.
FAINT = 500.0
# The share of such a one, or a small one, where the first leaves no more than the noise: the square
# of an error of 10 %.
COARSE_LAW = 0.01
# Size of a second, in plausible sizes, below which it may be what another law of the first has left
# (such had 0.1 to 0.35).
SMALL = 0.4
# And below which it is none: what chance and other laws had left came to 0.03 and 0.04, the least
# of the true ones to 0.17.
TINY = 0.1
# Where both leave more than noise, the share of what the first leaves that a second has to close,
# of the squares and of the structure. What the first's own law leaves stays: beside real seconds up
# to half of either. What seemed a second there closed up to 0.4 of the squares, but no more than
# 0.15 of the structure.
REST = 0.5
# Share of the gap that is too little to look for more, of a model that never reaches the noise.
LITTLE = 0.04
# Share of the gap that the first of two effects closes at least.
PART = 0.2


def enough(final: FitResult, null: FitResult, reaches_noise: bool) -> bool:
    """Whether to look for no further effect: there is little left for it, or far too much."""
    if not final.effects:
        return False
    left, gap = excess(final), excess(null)
    if reaches_noise:
        return left > max((1.0 - PART) * gap, EVIDENCE_THRESHOLD)
    return left <= max(LITTLE * gap, EVIDENCE_THRESHOLD)


def counts(
    best: FitResult,
    base: FitResult,
    null: FitResult,
    reaches_noise: bool,
    *,
    by_chance: float = 0.0,
    exact: bool = False,
) -> bool:
    """Whether one more effect earns its place.

    What a law slightly other than the library's leaves is no second effect. It is not white, and
    its evidence says nothing.

    by_chance : evidence of an effect of chance course, whose unrest all these fits have
    exact : whether the law of what is there already can have no other form
    """
    fall = base.cost - best.cost
    evidence = evidence_of(fall, best, null)
    sizes = [best.relative_sizes[name] for name in best.effects if name not in base.effects]
    tiny = reaches_noise and base.effects and min(sizes) < TINY
    if tiny or evidence <= LAW * by_chance:
        return False
    if not reaches_noise:
        return evidence > EVIDENCE_THRESHOLD
    if not base.effects:
        # The first of several leaves a correlated rest: it is judged by the gap as well.
        gap = excess(null)
        closes = gap > EVIDENCE_THRESHOLD and fall > max(EVIDENCE_THRESHOLD, PART_OF_GAP * gap)
        return closes or evidence > EVIDENCE_THRESHOLD
    small = not exact and any(size < SMALL for size in sizes)
    if base.mean_square <= NOISE_MEAN_SQUARE:
        coarse = small or evidence < FAINT
        left = 0.0 if exact else COARSE_LAW if coarse else LAW
        return evidence > SECOND and fall > left * excess(null)
    if noise_only(best):
        return evidence > SECOND and fall > (UNEXPLAINED_SHARE if small else LAW) * excess(null)
    orderly = _ordered(best) <= (1.0 - REST) * _ordered(base)
    most = fall > max(
        REST * (base.sum_of_squares - base.samples),
        UNEXPLAINED_SHARE * excess(null) if small else 0.0,
    )
    return evidence > EVIDENCE_THRESHOLD and orderly and most


def _ordered(point: FitResult) -> float:
    """Structure beyond what noise may have [chi squared]."""
    return max(0.0, point.ljung_box_excess - LJUNG_BOX_LIMIT)


def noise_only(point: FitResult) -> bool:
    """Whether a fit leaves as little as the noise, and as random."""
    return point.mean_square <= NOISE_MEAN_SQUARE and point.ljung_box_excess <= LJUNG_BOX_LIMIT
