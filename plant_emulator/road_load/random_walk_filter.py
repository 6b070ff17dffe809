"""Residuals of a simulated velocity made white: a Kalman filter of one random walk (pure).

    residual = walk + white,   walk(k+1) = walk(k) + step,   walk = 0 where the truck stands

    K = P / (P + R)   P <- (1 - K) P + Q            R, Q : variances of white and step
    white residual = (residual - walk estimate) / sqrt(P + R)

The gains do not depend on the residual, so that the same filter whitens its derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.road_load.kernel import compiled, foreseen

if TYPE_CHECKING:
    from plant_emulator.road_load.signal import Mask
    from plant_emulator.signals.log import Array


LOST = 0.05
"""[m/s] as which the walk may be anything, after the truck came near to rest."""


@dataclass(frozen=True, kw_only=True)
class Whitener:
    """Gains [1], shape (m,), deviations of what is new in each sample, and where the walk is 0."""

    gain: Array
    deviation: Array
    known: Mask
    rests: Mask

    def whitened(self, residuals: Array) -> Array:
        """Residuals, shape (m, columns), in standard deviations and without what was foreseen.

        Samples that are not known are left out: the result has as many rows as are known.
        """
        new = residuals - compiled(foreseen)(residuals, self.gain, self.rests)
        found: Array = (new / self.deviation[:, None])[self.known]
        return found

    def misfit(self, residual: Array) -> float:
        """-2 log likelihood of a residual, up to a constant."""
        white = self.whitened(residual[:, None])
        return float(np.sum(white**2) + 2.0 * np.sum(np.log(self.deviation[self.known])))


def whitener(white: float, step: float, known: Mask, rests: Mask, moves: Mask) -> Whitener:
    """The filter for standard deviations of the white part and of the walk's step, equal units."""
    gain, deviation = np.zeros(len(known)), np.ones(len(known))
    variance, moved = step**2, False
    for k in range(len(known)):
        if rests[k]:
            variance = 0.0
        elif moved and not moves[k]:
            variance = LOST**2
        moved = bool(moves[k])
        total = variance + white**2
        deviation[k] = np.sqrt(total)
        if known[k]:
            gain[k] = variance / total
        variance = (1.0 - gain[k]) * variance + step**2
    return Whitener(gain=gain, deviation=deviation, known=known, rests=rests)
