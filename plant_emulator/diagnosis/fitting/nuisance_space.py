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
from weakref import WeakKeyDictionary

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.estimation.robust_scan import ANGLES, turning, turns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
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

    def orthogonal_by_run(self, change: Array) -> list[Array]:
        """The orthogonal part of the change of each run alone, each of the shape of the change."""
        found, first = [], 0
        for residual in self.estimate.residuals:
            part = np.zeros_like(change)
            part[first : first + residual.size] = change[first : first + residual.size]
            first += residual.size
            found.append(self.orthogonal(part))
        return found

    def shifted(self, shift: Array, runs: int) -> tuple[dict[str, float], list[dict[str, float]]]:
        """Values and states of so many runs after a shift of z, within their bounds."""
        values: dict[str, float] = {}
        states: list[dict[str, float]] = [{} for _ in range(runs)]
        for u, z in zip(self.estimate.unknowns, self.estimate.z + shift, strict=True):
            value = u.value(float(np.clip(z, u.scaled(u.lower), u.scaled(u.upper))))
            (values if u.run is None else states[u.run])[u.name] = value
        return values, states


# The last space of each model that is alive: the signature of every effect asks for the same one.
_LAST: WeakKeyDictionary[Model, tuple[object, NuisanceSpace]] = WeakKeyDictionary()


def nuisance_space(model: Model, found: FitResult, runs: Sequence[int]) -> NuisanceSpace:
    """The nuisance space at a fit; the last one of each model is kept."""
    key = (found.key, tuple(runs))
    known, space = _LAST.get(model, (None, None))
    if space is None or known != key:
        space = NuisanceSpace(linearise(model, found, runs))
        _LAST[model] = key, space
    return space


def gain_along(signature: Array, residual: Array) -> float:
    """Fall of the sum of squares at the best multiple of a signature; 0 for a negative multiple."""
    along = min(0.0, float(signature @ residual))
    return along**2 / max(float(signature @ signature), 1e-12)


def gain_at_best_angle(
    at_zero: Array, at_quarter: Array, at_half: Array, residual: Array
) -> tuple[float, float]:
    """Fall of the sum of squares at the best multiple and angle of a signature, and that angle.

    The signature is a mean plus a cosine and a sine of the angle [rad].
    at_zero, at_quarter, at_half : the signature at 0, pi/2 and pi
    """
    basis = turning(at_zero, at_quarter, at_half)
    gram, along = basis @ basis.T, basis @ residual
    weights = turns(ANGLES)
    squares = np.maximum(np.einsum("ai,ij,aj->a", weights, gram, weights), 1e-12)
    gains = np.minimum(0.0, weights @ along) ** 2 / squares
    best = int(np.argmax(gains))
    return float(gains[best]), float(ANGLES[best])
