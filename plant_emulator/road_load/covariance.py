"""How sure a fit of road logs is of its values (pure).

    cov = H^-1 (L J'J + P'P) H^-1,   H = J'J + P'P

J, P: derivatives of the whitened residual and of the prior. L is the long-run variance of the
whitened residual (Bartlett's weights): 1 where it is white, more where neighbours are alike, so
that a thousand samples of one and the same misfit do not count as a thousand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.road_load.fit import RoadFit
    from plant_emulator.signals.log import Array

LAGS = 1.5
"""[s] over which neighbours of the residual are compared."""


def covariance_of(fit: RoadFit) -> Array:
    """Covariance of the free parameters, shape (free, free)."""
    rows = len(fit.residual) - len(fit.prior.rows)
    data, known = fit.jacobian[:rows], fit.jacobian[rows:]
    scale = np.sqrt(np.sum(fit.jacobian**2, axis=0))
    data, known = data / scale, known / scale
    information, prior = data.T @ data, known.T @ known
    inverse = np.linalg.inv(information + prior)
    spread = residual_variance(fit) * information + prior
    found: Array = inverse @ spread @ inverse / np.outer(scale, scale)
    return found


def residual_variance(fit: RoadFit) -> float:
    """Long-run variance of the whitened residual of the data."""
    rows = len(fit.residual) - len(fit.prior.rows)
    return long_run_variance(fit.residual[:rows], round(LAGS / fit.run.spacing))


def long_run_variance(white: Array, lags: int) -> float:
    """Variance of a sum of neighbours, per sample; white noise has its variance.

    At least 1, what the noise of the sensors themselves makes: less is chance.
    """
    total = float(np.mean(white**2))
    for lag in range(1, lags):
        weight = 2.0 * (1.0 - lag / lags)
        total += weight * float(np.mean(white[lag:] * white[:-lag]))
    return max(total, 1.0)
