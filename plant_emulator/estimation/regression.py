"""Gain of log evidence by columns beside nuisance columns, all with Gaussian priors (pure).

    y = F theta + C beta + white noise,   theta ~ N(0, 1),   beta ~ N(0, 1)

With the nuisance integrated out, all that columns can gain is in C' M y and C' M C, where
M = (1 + F F')^-1. The gain of C beside F is

    1/2 g' V^-1 g - 1/2 log det V,   V = 1 + C' M C,   g = C' M y

(MacKay, Neural Computation 4 (1992) 415).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


@dataclass(frozen=True)
class Regression:
    """Data beside nuisance columns that are integrated out.

    y : data, shape (n,); nuisance : F, scaled to unit priors, shape (n, k)
    lower : Cholesky factor of 1 + F'F; left : M y
    """

    y: Array
    nuisance: Array
    lower: Array
    left: Array

    @classmethod
    def of(cls, y: Array, nuisance: Array) -> Regression:
        """Factor the nuisance's precision once; y : shape (n,), nuisance : shape (n, k)."""
        gram = np.eye(nuisance.shape[1]) + nuisance.T @ nuisance
        lower = np.asarray(np.linalg.cholesky(gram), float)
        return cls(y, nuisance, lower, y - nuisance @ _solve(lower, nuisance.T @ y))

    def along(self, columns: Array) -> Array:
        """Products C' M y, shape (k,)."""
        return np.asarray(columns.T @ self.left)

    def gram(self, columns: Array) -> Array:
        """Products C' M C, shape (k, k)."""
        from scipy.linalg import solve_triangular

        seen = solve_triangular(self.lower, self.nuisance.T @ columns, lower=True)
        return np.asarray(columns.T @ columns - seen.T @ seen)

    def theta(self, columns: Array, beta: Array) -> Array:
        """Nuisance coefficients beside these columns at these coefficients, shape (k,)."""
        return _solve(self.lower, self.nuisance.T @ (self.y - columns @ beta))

    def follow(self, column: Array) -> Array:
        """Nuisance coefficients that follow a column best, shape (k,)."""
        return _solve(self.lower, self.nuisance.T @ column)


def gain(gram: Array, along: Array) -> tuple[float, Array]:
    """Gain of log evidence [1], and mean of the coefficients, of columns with unit priors.

    gram : C' M C, shape (k, k); along : C' M y, shape (k,)
    """
    lower = np.asarray(np.linalg.cholesky(np.eye(len(gram)) + gram), float)
    mean = _solve(lower, along)
    return float(0.5 * along @ mean - np.log(np.diag(lower)).sum()), mean


def _solve(lower: Array, right: Array) -> Array:
    from scipy.linalg import cho_solve

    return np.asarray(cho_solve((lower, True), right))
