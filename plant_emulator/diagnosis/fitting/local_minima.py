"""Leads a joint fit out of the local minima that instants of contact leave in its cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.estimation.kinks import WORTH, beyond_kink
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE, estimate
from plant_emulator.estimation.simulated_problem import DIFFERENCE_NORM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.estimation.unknowns import Estimate, Residual

# Relative fall of the cost that ends a fit near the noise: some tenths in units of chi squared.
COST_TOLERANCE = 1e-5
# Relative fall of the cost that ends a fit far from the noise, where it lacks a cause in any case,
# or a fit whose slopes follow by secants.
COARSE_COST_TOLERANCE = 1e-4
# Norm of the change that wide slopes are taken over, as a share of the residual's norm. It led out
# of a minimum of 2 % of the cost, in which another effect had passed for a cause; 0.05 did not.
WIDE_SHARE = 0.15


def led_over_kinks(
    found: Estimate,
    residuals: Sequence[Residual],
    rough: Sequence[Residual],
    iterations: int | None,
) -> Estimate:
    """The fit, led over the kinks of its cost as long as that is worth it."""
    while found.cost > SUSPECT_MEAN_SQUARE * found.samples:
        beyond = beyond_kink(found.started, rough)
        if beyond is None:
            break
        other = estimate(
            beyond,
            residuals,
            settled=COST_TOLERANCE,
            settled_far=COARSE_COST_TOLERANCE,
            iterations=iterations,
        )
        if other.cost > (1.0 - WORTH) * found.cost:
            return min(found, other, key=lambda one: one.cost + one.penalty)
        found = other
    return found


def with_wide_slopes(found: Estimate, residuals: Sequence[Residual]) -> Estimate:
    """The fit, or a better one that wide slopes lead to.

    Instants of contact leave narrow minima in the cost, a few per cent deep. Slopes over a wide
    change pass over most of them.
    """
    other = found
    for difference in (WIDE_SHARE * found.cost**0.5, DIFFERENCE_NORM):
        other = estimate(
            other.started,
            residuals,
            settled=COST_TOLERANCE,
            settled_far=COARSE_COST_TOLERANCE,
            difference=difference,
        )
    lower = other.cost + other.penalty < (1.0 - COARSE_COST_TOLERANCE) * (
        found.cost + found.penalty
    )
    return other if lower else found
