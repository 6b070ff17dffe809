"""Whitens the residual of a simulated velocity by a Kalman filter of a random walk (pure).

    residual = walk + white,   walk(k+1) = walk(k) + step,   walk = 0 where the truck stands

    K = P / (P + R)   P <- (1 - K) P + Q            R, Q : variances of white and step
    whitened residual = (residual - predicted walk) / sqrt(P + R)

The gains do not depend on the residual, so the filter also whitens derivatives of the residual.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.road_load.kernel import compile_loop, predict_walk

if TYPE_CHECKING:
    from plant_emulator.road_load.signal import Mask
    from plant_emulator.signals.log import Array


UNKNOWN_WALK = 0.05
"""Standard deviation of the walk after the truck came close to standstill [m/s]."""


@dataclass(frozen=True, kw_only=True)
class RandomWalkFilter:
    """A Kalman filter, fixed before the fit.

    gain : Kalman gain [1], shape (m,)
    deviation : standard deviation of the innovation [m/s], shape (m,)
    valid : samples that count, shape (m,); rests : where the walk is 0, shape (m,)
    """

    gain: Array
    deviation: Array
    valid: Mask
    rests: Mask

    def whiten(self, residuals: Array) -> Array:
        """Innovations in standard deviations, shape (valid samples, columns).

        residuals : [m/s], shape (m, columns)
        """
        innovation = residuals - compile_loop(predict_walk)(residuals, self.gain, self.rests)
        found: Array = (innovation / self.deviation[:, None])[self.valid]
        return found

    def misfit(self, residual: Array) -> float:
        """-2 log likelihood of a residual, up to a constant."""
        white = self.whiten(residual[:, None])
        return float(np.sum(white**2) + 2.0 * np.sum(np.log(self.deviation[self.valid])))


def whitener(white: float, step: float, valid: Mask, rests: Mask, moves: Mask) -> RandomWalkFilter:
    """Filter for a white part and a random walk.

    white, step : standard deviations of the white part and of the walk's step, same unit
    valid, rests, moves : where samples count, the truck stands, the truck moves, shape (m,) each
    """
    gain, deviation = np.zeros(len(valid)), np.ones(len(valid))
    variance, moved = step**2, False
    for k in range(len(valid)):
        if rests[k]:
            variance = 0.0
        elif moved and not moves[k]:
            variance = UNKNOWN_WALK**2
        moved = bool(moves[k])
        total = variance + white**2
        deviation[k] = np.sqrt(total)
        if valid[k]:
            gain[k] = variance / total
        variance = (1.0 - gain[k]) * variance + step**2
    return RandomWalkFilter(gain=gain, deviation=deviation, valid=valid, rests=rests)
