"""The evidence of an effect, and the thresholds that it is judged by.

The evidence of a fall of the cost from one fit to a better one is

    evidence = fall / max(1, mean square of the better fit) * effective sample fraction

A fit that leaves much more than the noise leaves something correlated, which makes wrong effects
count. Its sample fraction is then no larger than that of the fit without effects.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult

# Evidence from which on an effect counts.
EVIDENCE_THRESHOLD = 25.0
# Two effects whose evidence differs by less cannot be told apart: odds of 150 to 1.
CLASS_MARGIN = 10.0
# An effect is detectable from this norm of its orthogonal signature on, at its plausible size [1].
DETECTABLE_NORM = 7.0
# Share of the gap that an adequate model may leave, or of what other effects leave, or that a wave
# of the turns may hold of what is explained. Laws other than the library's left up to 0.06 since
# effects have shapes (0.17 before). Without the true effect the best one left 0.14 and more.
UNEXPLAINED_SHARE = 0.1
# Share of the gap that the largest one of three causes explains at least, unless they counteract:
# a set has up to three. A fit that explains less is no reason to fit anew, and no base for another
# cause.
LARGEST_SHARE = 1.0 / 3.0
# Mean square up to which a fit leaves nothing but noise: its variance is uncertain by 2 % (one
# standard deviation), and the noise of real logs is no exact model of theirs.
NOISE_MEAN_SQUARE = 1.05
# Ljung-Box excess from which on a residual is not white noise [chi squared].
LJUNG_BOX_LIMIT = 200.0
# Ljung-Box excess of a residual, as a share of its squares beyond the noise, up to which the gap
# may be random. A dead time that varies at each scan had left 0.014.
RANDOM_SHARE = 0.05


def evidence_of(fall: float, better: FitResult, null: FitResult) -> float:
    """Evidence of a fall of the cost [1].

    fall : of the cost, down to that of the better fit
    null : fit without effects
    """
    fraction = better.effective_fraction
    if better.mean_square > SUSPECT_MEAN_SQUARE:
        fraction = min(fraction, null.effective_fraction)
    return max(0.0, fall) / max(1.0, better.mean_square) * fraction


def excess(found: FitResult) -> float:
    """Sum of squares beyond what the noise explains [chi squared]."""
    return max(0.0, found.sum_of_squares - NOISE_MEAN_SQUARE * found.samples)


def significant(found: FitResult, null: FitResult) -> bool:
    """Whether a fit with effects explains more than chance does."""
    return evidence_of(null.cost - found.cost, found, null) >= EVIDENCE_THRESHOLD


def leaves_little(found: FitResult, gap: float) -> bool:
    """Whether a fit leaves so little of a gap that its cause is known.

    gap : sum of squares beyond the noise without the cause [chi squared]
    """
    return excess(found) <= max(UNEXPLAINED_SHARE * gap, EVIDENCE_THRESHOLD)


def leaves_most(found: FitResult, null: FitResult) -> bool:
    """Whether a fit leaves more of the gap than the largest one of three causes leaves."""
    return excess(found) > (1.0 - LARGEST_SHARE) * excess(null)


def adequate(found: FitResult, null: FitResult) -> bool:
    """Whether a fit leaves so little of the gap without effects that its cause is known."""
    return leaves_little(found, excess(null))


def leaves_random(found: FitResult) -> bool:
    """Whether a fit leaves more than the noise, and that may be random."""
    large = found.mean_square > NOISE_MEAN_SQUARE
    return large and found.ljung_box_excess <= RANDOM_SHARE * excess(found)
