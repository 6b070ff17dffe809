"""What drift can imitate: the tangent space of the drifting parameters at a fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.robust_scan import ANGLES, turning, turns

if TYPE_CHECKING:
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array


class Tangents:
    """The drift's tangent space at a fit, for removing from signatures what drift can imitate."""

    def __init__(self, found: Estimate) -> None:
        p = len(found.z)
        self.found = found
        self.residual = np.concatenate([r.ravel() for r in found.residuals])
        self._slopes = np.concatenate([j.reshape(-1, p) for j in found.jacobians])
        precision = np.diag([u.scaled_std**-2.0 for u in found.unknowns])
        self._inverse = np.linalg.pinv(found.information + precision, hermitian=True)

    def imitation(self, change: Array) -> Array:
        """Shift of z that follows a change of the residual best."""
        return np.asarray(-self._inverse @ (self._slopes.T @ change))

    def rest(self, change: Array) -> Array:
        """The change of the residual that remains when drift follows it."""
        return np.asarray(change + self._slopes @ self.imitation(change))

    def parts(self, change: Array) -> list[Array]:
        """What remains of a change of each run alone."""
        found, first = [], 0
        for residual in self.found.residuals:
            part = np.zeros_like(change)
            part[first : first + residual.size] = change[first : first + residual.size]
            first += residual.size
            found.append(self.rest(part))
        return found

    def moved(self, shift: Array, runs: int) -> tuple[dict[str, float], list[dict[str, float]]]:
        """Values and states after a shift of z, within their bounds."""
        values: dict[str, float] = {}
        states: list[dict[str, float]] = [{} for _ in range(runs)]
        for u, z in zip(self.found.unknowns, self.found.z + shift, strict=True):
            value = u.value(float(np.clip(z, u.scaled(u.lower), u.scaled(u.upper))))
            (values if u.run is None else states[u.run])[u.name] = value
        return values, states


def gain_along(rest: Array, residual: Array) -> float:
    """Fall of the sum of squares at the best multiple of a signature, 0 where that is negative."""
    along = min(0.0, float(rest @ residual))
    return along**2 / max(float(rest @ rest), 1e-12)


def gain_turned(ahead: Array, aside: Array, behind: Array, residual: Array) -> tuple[float, float]:
    """Fall of the sum of squares at the best multiple of a signature that turns with an angle, and
    that angle; ahead, aside, behind : at 0, pi/2 and pi.
    """
    basis = turning(ahead, aside, behind)
    gram, along = basis @ basis.T, basis @ residual
    weights = turns(ANGLES)
    squares = np.maximum(np.einsum("ai,ij,aj->a", weights, gram, weights), 1e-12)
    gains = np.minimum(0.0, weights @ along) ** 2 / squares
    best = int(np.argmax(gains))
    return float(gains[best]), float(ANGLES[best])
