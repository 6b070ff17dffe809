"""The marginal likelihood of a linear model whose coefficients lie in groups of unknown size.

    y = F theta + sum_g B_g beta_g + white noise,   theta ~ N(0, 1),   beta_g ~ N(0, a_g^2)

The marginal likelihood is the probability of y with theta and beta integrated out. Its logarithm is

    - y'y/2 + v'v/2 - log det L,    L L' = 1 + S G S,  v = L^-1 S g,  G = X'X, g = X'y, X = [F B]

S is the diagonal of the standard deviations. The sizes a_g maximise it; a_g = 0 leaves the group
out (automatic relevance determination: D. MacKay, Neural Computation 4 (1992) 415). A group that
explains only noise makes the marginal likelihood smaller, and is not taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

# Sizes a_g that are tried.
GROUP_SIZES = np.geomspace(1e-2, 30.0, 9)
# The sizes of all groups are chosen again at most so many times.
MOST_SWEEPS = 3
# Another group, or another sweep, is worth this gain of log probability.
LEAST_LOG_GAIN = 0.5


@dataclass(frozen=True)
class MarginalLikelihood:
    """The largest marginal likelihood of a model.

    log : its logarithm
    mean : posterior mean of theta and beta, shape (k,)
    residual : y without what they explain, shape (n,)
    """

    log: float
    mean: Array
    residual: Array


def log_marginal_likelihood(gram: Array, product: Array, deviations: Array) -> float:
    """v'v/2 - log det L of the module's text; deviations : diagonal of S."""
    lower = np.linalg.cholesky(_system(gram, deviations))
    v = np.linalg.solve(lower, deviations * product)
    return float(0.5 * v @ v - np.log(np.diag(lower)).sum())


def _system(gram: Array, deviations: Array) -> Array:
    return np.asarray(np.eye(len(gram)) + deviations[:, None] * gram * deviations)


class Products:
    """Products of groups of columns, each computed once; no array of a group ever changes."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, int], tuple[Array, Array, Array]] = {}
        self._rows: dict[int, tuple[int, int]] = {}

    def of(self, a: Array, b: Array) -> Array:
        """Product A' B of two arrays, over the rows where both are not zero."""
        key = (id(a), id(b))
        if key not in self._known:
            transposed = self._known.get((id(b), id(a)))
            found = self._product(a, b) if transposed is None else transposed[2].T
            self._known[key] = (a, b, found)  # a kept array keeps its identity
        return self._known[key][2]

    def _product(self, a: Array, b: Array) -> Array:
        (begin, end), (first, last) = self._within(a), self._within(b)
        rows = slice(max(begin, first), max(min(end, last), begin, first))
        return np.asarray(a[rows].T @ b[rows])

    def _within(self, a: Array) -> tuple[int, int]:
        """First row of an array that is not zero, and the row behind the last one."""
        if id(a) not in self._rows:
            filled = np.flatnonzero(np.any(a != 0.0, axis=1))
            self._rows[id(a)] = (int(filled[0]), int(filled[-1]) + 1) if len(filled) else (0, 0)
        return self._rows[id(a)]


class LinearModel:
    """Data y with the nuisance columns F, which are scaled to unit priors, in parts.

    products : of columns, shared with other data that have the same ones
    """

    def __init__(
        self, y: Array, nuisance: Sequence[Array], products: Products | None = None
    ) -> None:
        self.y, self.nuisance = y, tuple(nuisance)
        self.square = float(y @ y)
        self._y = y[:, None]
        self._products = products or Products()

    def left(self, rows: slice) -> float:
        """Sum of squares that the nuisance columns leave of these rows, with their penalty."""
        y, x = self.y[rows], np.concatenate([part[rows] for part in self.nuisance], axis=1)
        product = x.T @ y
        system = np.eye(x.shape[1]) + x.T @ x
        return float(y @ y - product @ np.linalg.solve(system, product))

    def marginal_likelihood(self, groups: Sequence[Array]) -> MarginalLikelihood:
        """The largest marginal likelihood over the sizes of these groups of columns."""
        parts, of = [*self.nuisance, *groups], self._products.of
        gram = np.block([[of(a, b) for b in parts] for a in parts])
        product = np.concatenate([of(a, self._y)[:, 0] for a in parts])
        known = sum(part.shape[1] for part in self.nuisance)
        counts = [known, *(group.shape[1] for group in groups)]
        search = _SizeSearch(gram, product, counts)
        search.run()
        deviations = np.repeat(search.sizes, counts)
        system = _system(gram, deviations)
        mean = deviations * np.linalg.solve(system, deviations * product)
        residual = self.y.copy()
        ends = np.cumsum([part.shape[1] for part in parts])[:-1]
        for part, own in zip(parts, np.split(mean, ends), strict=True):
            residual -= part @ own
        return MarginalLikelihood(search.best - 0.5 * self.square, mean, residual)


class _SizeSearch:
    """The search for the sizes: first the group of the largest gain, then all taken ones anew."""

    def __init__(self, gram: Array, product: Array, counts: Sequence[int]) -> None:
        self.gram, self.product, self.counts = gram, product, counts
        self.group_of = np.repeat(np.arange(len(counts)), counts)
        self.sizes = np.zeros(len(counts))
        self.sizes[0] = 1.0
        nuisance = self.group_of == 0
        alone = np.ones(int(nuisance.sum()))
        self.best = log_marginal_likelihood(
            gram[np.ix_(nuisance, nuisance)], product[nuisance], alone
        )

    def run(self) -> None:
        """Search the sizes of the largest marginal likelihood."""
        for _ in range(MOST_SWEEPS):
            before = self.best
            self._take_groups()
            for k in np.flatnonzero(self.sizes[1:]) + 1:
                ((value, group, size),) = self._trials([int(k)], np.append(0.0, GROUP_SIZES))
                if value > self.best:
                    self.best, self.sizes[group] = value, size
            if self.best - before < LEAST_LOG_GAIN:
                break

    def _take_groups(self) -> None:
        """Take the group of the largest gain, until none is worth it."""
        while absent := [int(k) for k in np.flatnonzero(self.sizes == 0.0)]:
            value, group, size = max(self._trials(absent, GROUP_SIZES))
            if value <= self.best + LEAST_LOG_GAIN:
                break
            self.best, self.sizes[group] = value, size

    def _trials(self, groups: Sequence[int], sizes: Array) -> list[tuple[float, int, float]]:
        """The best of these sizes of each of these groups alone: value, group, size.

        The other groups stay as they are. With them integrated out, a group's own products give all
        sizes at once.
        """
        from scipy.linalg import solve_triangular

        rest = np.isin(self.group_of, groups)
        used = (self.sizes[self.group_of] > 0.0) & ~rest
        deviations = self.sizes[self.group_of][used]
        lower = np.linalg.cholesky(_system(self.gram[np.ix_(used, used)], deviations))
        right = np.column_stack([self.product[used], self.gram[np.ix_(used, rest)]])
        solved = solve_triangular(lower, deviations[:, None] * right, lower=True)
        v, cross = solved[:, 0], solved[:, 1:]
        others = float(0.5 * v @ v - np.log(np.diag(lower)).sum())
        found = []
        for group in groups:
            own, column = self.group_of == group, self.group_of[rest] == group
            along = self.product[own] - cross[:, column].T @ v
            gram = self.gram[np.ix_(own, own)] - cross[:, column].T @ cross[:, column]
            value, size = _best_size(gram, along, sizes)
            found.append((others + value, group, size))
        return found


def _best_size(gram: Array, along: Array, sizes: Array) -> tuple[float, float]:
    """Gain of a group of columns at the best of these sizes, and that size."""
    spectrum, vectors = np.linalg.eigh(gram)
    seen = (vectors.T @ along) ** 2
    grown = 1.0 + np.outer(sizes**2, np.maximum(spectrum, 0.0))
    values = 0.5 * ((sizes**2)[:, None] * seen / grown - np.log(grown)).sum(axis=1)
    k = int(np.argmax(values))
    return float(values[k]), float(sizes[k])


def variance_gain(residual: Array, weight: Array) -> float:
    """Largest gain of log probability if a residual has the variance 1 + (s weight)^2.

    It covers what varies from sample to sample, which no smooth law follows.
    """
    weight = weight / max(float(np.max(np.abs(weight))), 1e-12)
    trials = [1.0 + (size * weight) ** 2 for size in GROUP_SIZES]
    gains = [0.5 * np.sum(residual**2 * (1.0 - 1.0 / v) - np.log(v)) for v in trials]
    return max(0.0, float(max(gains)) - float(np.log(len(GROUP_SIZES))))
