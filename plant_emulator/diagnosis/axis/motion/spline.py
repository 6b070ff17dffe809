"""Least-squares splines of noisy samples: the spacing of the knots follows from the samples.

Knots that lie too far apart leave motion in the residual, and knots that lie too close follow the
noise. Generalised cross-validation chooses (P. Craven, G. Wahba, Numerische Mathematik 31 (1979)
377), each coefficient counted 1.4 times against too close knots (Y.-J. Kim, C. Gu, J. R. Statist.
Soc. B 66 (2004) 337). Times may be uneven.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

DEGREE = 5
# What a coefficient counts in the cross-validation.
COUNTED = 1.4
# Samples between two knots that are tried.
SPACINGS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96)


@dataclass(frozen=True, kw_only=True)
class Smooth:
    """A smooth curve through noisy samples.

    curve : the spline; spacing : of its knots [s]; noise : deviation of a sample about it
    period : of the samples [s]
    """

    curve: Any
    spacing: float
    noise: float
    period: float

    def deviation(self, derivative: int) -> float:
        """Standard deviation of a derivative of the curve: the noise in the band of its knots."""
        highest = np.pi / self.spacing
        share = self.period / self.spacing
        return float(self.noise * np.sqrt(share / (2 * derivative + 1)) * highest**derivative)


def smooth(time: Array, value: Array) -> Smooth:
    """The smooth curve of samples, shape (n,). Raises ValueError for too few samples."""
    from scipy.interpolate import make_lsq_spline

    count, period = len(time), float(np.median(np.diff(time)))
    best: tuple[float, Smooth] | None = None
    for spacing in SPACINGS:
        inner = time[spacing:-spacing:spacing]
        coefficients = len(inner) + DEGREE + 1
        if COUNTED * coefficients >= count or not len(inner):
            continue
        knots = np.r_[[time[0]] * (DEGREE + 1), inner, [time[-1]] * (DEGREE + 1)]
        curve = make_lsq_spline(time, value, knots, DEGREE, method="norm-eq")
        left = float(np.sum((value - curve(time)) ** 2))
        score = left / (count - COUNTED * coefficients) ** 2
        if best is None or score < best[0]:
            noise = float(np.sqrt(left / (count - coefficients)))
            found = Smooth(curve=curve, spacing=spacing * period, noise=noise, period=period)
            best = (score, found)
    if best is None:
        raise ValueError(f"{count} samples are too few for a spline")
    return best[1]
