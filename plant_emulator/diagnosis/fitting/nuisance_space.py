"""The space of the residual's changes that the nuisance parameters can follow.

At a fit, the columns of the Jacobian J span the changes of the whitened residual that nuisance
parameters and initial states can make. A change d of the residual is projected on that space, with
the priors' precision P:

    shift of z that follows d best   dz = -(J' J + P)^-1 J' d
    part of d that stays             d + J dz

The part that stays is the orthogonal part: what no nuisance parameter can follow (M. Basseville,
I. Nikiforov, INRIA RR-4438, 2002).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array


class NuisanceSpace:
    """The tangent space of the nuisance parameters at a fit.

    estimate : the linearise fit; residual : all its residuals as one vector
    """

    def __init__(self, found: Estimate) -> None:
        p = len(found.z)
        self.estimate = found
        self.residual = np.concatenate([r.ravel() for r in found.residuals])
        self._slopes = np.concatenate([j.reshape(-1, p) for j in found.jacobians])
        precision = np.diag([u.scaled_std**-2.0 for u in found.unknowns])
        self._inverse = np.linalg.pinv(found.information + precision, hermitian=True)

    def projection(self, change: Array) -> Array:
        """Shift of z that follows a change of the residual best, shape (unknowns,)."""
        return np.asarray(-self._inverse @ (self._slopes.T @ change))

    def orthogonal(self, change: Array) -> Array:
        """Part of a change of the residual that no nuisance parameter can follow, same shape."""
        return np.asarray(change + self._slopes @ self.projection(change))
