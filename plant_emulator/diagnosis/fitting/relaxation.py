"""Least squares around a fit that has more unknowns than it was fitted with (pure)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import effective_fraction

if TYPE_CHECKING:
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Relaxed:
    """The least penalised sum of squares by the slopes at a point.

    change : of all unknowns on the scale of the estimation, shape (unknowns,)
    covariance : of them, for white residuals of variance 1
    inflation : of that covariance, by what is left there and its autocorrelation [1]
    """

    change: Array
    covariance: Array
    inflation: float


def relax(near: Estimate) -> Relaxed:
    """Solve the linear least squares at a point; its unknowns without a prior are free."""
    information, gradient = normal_equations(near)
    covariance = np.asarray(np.linalg.pinv(information, hermitian=True))
    change = -covariance @ gradient
    left = tuple(
        r + columns @ change for r, columns in zip(near.residuals, near.jacobians, strict=True)
    )
    square = sum(float(np.sum(r**2)) for r in left) / near.samples
    inflation = max(1.0, square) / effective_fraction(replace(near, residuals=left))
    return Relaxed(change=change, covariance=covariance, inflation=inflation)


def normal_equations(near: Estimate) -> tuple[Array, Array]:
    """Curvature and gradient of half the penalised sum of squares, by the slopes at a point."""
    pairs = list(zip(near.unknowns, near.z, strict=True))
    precision = np.array([u.scaled_std**-2.0 for u, _ in pairs])
    gradient = np.array([0.0 if u.std is None else z - u.scaled(u.prior) for u, z in pairs])
    gradient, curvature = precision * gradient, np.diag(precision)
    for columns, residual in zip(near.jacobians, near.residuals, strict=True):
        rows = columns.reshape(-1, len(precision))
        curvature = curvature + rows.T @ rows
        gradient = gradient + rows.T @ residual.ravel()
    return curvature, gradient
