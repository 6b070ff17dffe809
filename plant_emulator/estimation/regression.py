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
    basis, upper : Q and R with F = Q R and 1 + F'F = R'R; seen : Q' y; left : M y
    """

    y: Array
    nuisance: Array
    basis: Array
    upper: Array
    seen: Array
    left: Array

    @classmethod
    def of(cls, y: Array, nuisance: Array) -> Regression:
        """Factor the nuisance's precision once; y : shape (n,), nuisance : shape (n, k)."""
        # In the squares of steep slopes the unit prior would be lost by rounding.
        both, upper = np.linalg.qr(np.concatenate([nuisance, np.eye(nuisance.shape[1])]))
        basis = both[: len(y)]
        seen = basis.T @ y
        return cls(y, nuisance, basis, upper, seen, y - nuisance @ _solve(upper, seen))

    @property
    def mean(self) -> Array:
        """Mean of the nuisance coefficients, shape (k,)."""
        return _solve(self.upper, self.seen)

    def products(self, columns: Array) -> Products:
        """Compute what the data say of columns, shape (n, k).

        C' M C is |C - F a|^2 + |a|^2, with the coefficients a that follow C. As the difference of
        two squares it came out negative for a steep slope that the nuisance follows.
        """
        seen = self.basis.T @ columns
        follow = _solve(self.upper, seen)
        left = columns - self.nuisance @ follow
        return Products(columns.T @ self.left, left.T @ left + follow.T @ follow, seen)

    def theta(self, products: Products, beta: Array) -> Array:
        """Nuisance coefficients beside columns at these coefficients, shape (k,)."""
        return _solve(self.upper, self.seen - products.seen @ beta)

    def follow(self, column: Array) -> Array:
        """Nuisance coefficients that follow a column best, shape (k,)."""
        return _solve(self.upper, self.basis.T @ column)


@dataclass(frozen=True)
class Products:
    """Products of columns C with the data and each other, the nuisance integrated out.

    along : C' M y, shape (k,); gram : C' M C, shape (k, k); seen : Q' C
    """

    along: Array
    gram: Array
    seen: Array


def gain(gram: Array, along: Array) -> tuple[float, Array]:
    """Gain of log evidence [1], and mean of the coefficients, of columns with unit priors.

    gram : C' M C, shape (k, k); along : C' M y, shape (k,)
    """
    from scipy.linalg import cho_solve

    lower = np.asarray(np.linalg.cholesky(np.eye(len(gram)) + gram), float)
    mean = cho_solve((lower, True), along)
    return float(0.5 * along @ mean - np.log(np.diag(lower)).sum()), mean


def _solve(upper: Array, right: Array) -> Array:
    """R^-1 times an array."""
    from scipy.linalg import solve_triangular

    return np.asarray(solve_triangular(upper, right))
