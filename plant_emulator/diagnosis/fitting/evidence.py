"""How much a fall of the cost says: the evidence of an effect, and its thresholds.

Evidence is the fall of the penalised sum of squares, over the mean square that the better model
leaves (at least 1, the noise), times the share of its samples that are independent. A model that
leaves much more than the noise leaves something correlated, which makes wrong effects count; its
share is then taken no larger than that of the fit without effects.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult

# Evidence from which on an effect counts.
THRESHOLD = 25.0
# Effects whose evidence differs by less cannot be told apart: odds of 150 to 1.
MARGIN = 10.0
# Drift-free signature at its plausible size from which on an effect is detectable, in the noise.
DETECTABLE = 7.0
# What the noise of a log is known to, as a part of its square.
NOISE_KNOWN = 0.02
# Share of the gap that may be left for the cause to be known. What a law slightly other than the
# library's left was up to 0.17; effects that are not in it left 0.4 and more with the best that is.
LEFT = 0.2
# Mean square up to which a model leaves nothing but noise.
NOISE_LEFT = 1.05
# Structure of a residual from which on it is no noise [chi squared].
STRUCTURED = 200.0
# Mean square from which on a model leaves more than what the noise explains.
MISFIT = 1.5


def weighed(fall: float, better: FitResult, null: FitResult) -> float:
    """Evidence of a fall of the cost, see the module's text."""
    share = better.share
    if better.chi_squared > MISFIT:
        share = min(share, null.share)
    return max(0.0, fall) / max(1.0, better.chi_squared) * share


def excess(point: FitResult) -> float:
    """Sum of squares beyond what the noise explains."""
    return max(0.0, point.squares - (1.0 + NOISE_KNOWN) * point.samples)


def evident(point: FitResult, null: FitResult) -> bool:
    """Whether a fit with effects explains more than chance does."""
    return weighed(null.cost - point.cost, point, null) >= THRESHOLD


def adequate(point: FitResult, null: FitResult) -> bool:
    """Whether a model leaves so little of the gap that its cause is known."""
    return excess(point) <= max(LEFT * excess(null), THRESHOLD)
