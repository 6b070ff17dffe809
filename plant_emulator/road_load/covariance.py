"""Covariance of the estimates of a fit of road logs (pure).

    cov = H^-1 (L J'J + P'P) H^-1,   H = J'J + P'P

J: derivatives of the whitened residual. P'P: precision of the prior. L: long-run variance of the
whitened residual with Bartlett's weights (Newey and West, Econometrica 55 (1987) 703). L is 1 for a
white residual. It is larger for correlated samples, which carry less information.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.road_load.fit import RoadFit
    from plant_emulator.signals.log import Array

LONGEST_LAG = 1.5
"""Longest lag of the long-run variance [s]."""


def covariance_of(fit: RoadFit) -> Array:
    """Covariance of the free parameters, shape (free, free)."""
    information = fit.jacobian.T @ fit.jacobian
    precision = np.diag(fit.prior.deviation[fit.free] ** -2.0)
    scale = np.sqrt(np.diag(information + precision))
    information, precision = (m / np.outer(scale, scale) for m in (information, precision))
    inverse = np.linalg.inv(information + precision)
    middle = residual_variance(fit) * information + precision
    found: Array = inverse @ middle @ inverse / np.outer(scale, scale)
    return found


def residual_variance(fit: RoadFit) -> float:
    """Long-run variance of the whitened residual [1]."""
    return long_run_variance(fit.residual, round(LONGEST_LAG / fit.run.spacing))


def long_run_variance(white: Array, lags: int) -> float:
    """Variance of the sum of consecutive samples, per sample [1].

    The result is at least 1, the variance of whitened sensor noise. A smaller value is chance.
    """
    total = float(np.mean(white**2))
    for lag in range(1, lags):
        weight = 2.0 * (1.0 - lag / lags)
        total += weight * float(np.mean(white[lag:] * white[:-lag]))
    return max(total, 1.0)
