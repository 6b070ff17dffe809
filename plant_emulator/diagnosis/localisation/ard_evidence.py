"""Evidence of a linear model with unknown coefficients, in groups of unknown size.

    y = F theta + sum_g B_g beta_g + white noise,   theta ~ N(0, 1),   beta_g ~ N(0, a_g^2)

The logarithm of the probability of y, theta and beta integrated out, is

    - y'y/2 + v'v/2 - log det L,    L L' = 1 + S G S,  v = L^-1 S g,  G = X'X, g = X'y, X = [F B]

with S the diagonal of the standard deviations. The sizes a_g are chosen to make it largest, a_g = 0
leaving the group out (automatic relevance determination: MacKay, Neural Computation 4 (1992) 415).
A group that explains only noise thus costs, and is not taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

SIZES = np.geomspace(1e-2, 30.0, 9)
SWEEPS = 3
# A gain of log probability that is worth another group, or another sweep.
WORTHWHILE_GAIN = 0.5


@dataclass(frozen=True)
class Evidence:
    """The best log probability; mean : of theta and beta; left : of y, without them."""

    log: float
    mean: Array
    left: Array


def log_evidence(gram: Array, product: Array, deviations: Array) -> float:
    """v'v/2 - log det L of the module's text."""
    lower = np.linalg.cholesky(_system(gram, deviations))
    v = np.linalg.solve(lower, deviations * product)
    return float(0.5 * v @ v - np.log(np.diag(lower)).sum())


def _system(gram: Array, deviations: Array) -> Array:
    return np.asarray(np.eye(len(gram)) + deviations[:, None] * gram * deviations)


class Products:
    """Products of groups of columns, kept: a group is one array and does not change."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, int], tuple[Array, Array, Array]] = {}
        self._rows: dict[int, tuple[int, int]] = {}

    def of(self, a: Array, b: Array) -> Array:
        """A' B, computed once for a pair of arrays, over the rows where both are not zero."""
        key = (id(a), id(b))
        if key not in self._known:
            transposed = self._known.get((id(b), id(a)))
            found = self._product(a, b) if transposed is None else transposed[2].T
            self._known[key] = (a, b, found)  # the arrays too: their identity stays theirs
        return self._known[key][2]

    def _product(self, a: Array, b: Array) -> Array:
        (begin, end), (first, last) = self._within(a), self._within(b)
        rows = slice(max(begin, first), max(min(end, last), begin, first))
        return np.asarray(a[rows].T @ b[rows])

    def _within(self, a: Array) -> tuple[int, int]:
        """The rows of an array that are not zero lie from the first of these to before the last."""
        if id(a) not in self._rows:
            filled = np.flatnonzero(np.any(a != 0.0, axis=1))
            self._rows[id(a)] = (int(filled[0]), int(filled[-1]) + 1) if len(filled) else (0, 0)
        return self._rows[id(a)]


class Linear:
    """Data y with its nuisance columns F (scaled to unit priors), in parts.

    products : of parts and groups, shared with other data that have them too
    """

    def __init__(
        self, y: Array, nuisance: Sequence[Array], products: Products | None = None
    ) -> None:
        self.y, self.nuisance = y, tuple(nuisance)
        self.square = float(y @ y)
        self._y = y[:, None]
        self._products = products or Products()

    def left(self, rows: slice) -> float:
        """Sum of squares of these rows that the nuisance leaves, their own prior paid."""
        y, x = self.y[rows], np.concatenate([part[rows] for part in self.nuisance], axis=1)
        product = x.T @ y
        system = np.eye(x.shape[1]) + x.T @ x
        return float(y @ y - product @ np.linalg.solve(system, product))

    def evidence(self, groups: Sequence[Array]) -> Evidence:
        """The evidence with groups of columns, each as large as the data want it."""
        parts, of = [*self.nuisance, *groups], self._products.of
        gram = np.block([[of(a, b) for b in parts] for a in parts])
        product = np.concatenate([of(a, self._y)[:, 0] for a in parts])
        known = sum(part.shape[1] for part in self.nuisance)
        counts = [known, *(group.shape[1] for group in groups)]
        search = _Sizes(gram, product, counts)
        search.run()
        deviations = np.repeat(search.sizes, counts)
        system = _system(gram, deviations)
        mean = deviations * np.linalg.solve(system, deviations * product)
        left = self.y.copy()
        ends = np.cumsum([part.shape[1] for part in parts])[:-1]
        for part, own in zip(parts, np.split(mean, ends), strict=True):
            left -= part @ own
        return Evidence(search.best - 0.5 * self.square, mean, left)


class _Sizes:
    """The search for the sizes: the group that gains most first, then all again in turn."""

    def __init__(self, gram: Array, product: Array, counts: Sequence[int]) -> None:
        self.gram, self.product, self.counts = gram, product, counts
        self.group_of = np.repeat(np.arange(len(counts)), counts)
        self.sizes = np.zeros(len(counts))
        self.sizes[0] = 1.0
        nuisance = self.group_of == 0
        alone = np.ones(int(nuisance.sum()))
        self.best = log_evidence(gram[np.ix_(nuisance, nuisance)], product[nuisance], alone)

    def run(self) -> None:
        """Find the sizes."""
        absent = list(range(1, len(self.counts)))
        while absent:
            gain, group, size = max(self._trial(group, SIZES) for group in absent)
            if gain <= self.best + WORTHWHILE_GAIN:
                break
            self.best, self.sizes[group] = gain, size
            absent.remove(group)
        for _ in range(SWEEPS):
            before = self.best
            for k in range(1, len(self.counts)):
                value, group, size = self._trial(k, np.append(0.0, SIZES))
                if value > self.best:
                    self.best, self.sizes[group] = value, size
            if self.best - before < WORTHWHILE_GAIN:
                break

    def _trial(self, group: int, sizes: Array) -> tuple[float, int, float]:
        """The best of these sizes of a group, the others as they are: value, group, size.

        With the others integrated out, the group's own products give all sizes at once.
        """
        from scipy.linalg import solve_triangular

        own = self.group_of == group
        used = (self.sizes[self.group_of] > 0.0) & ~own
        deviations = self.sizes[self.group_of][used]
        lower = np.linalg.cholesky(_system(self.gram[np.ix_(used, used)], deviations))
        right = np.column_stack([self.product[used], self.gram[np.ix_(used, own)]])
        solved = solve_triangular(lower, deviations[:, None] * right, lower=True)
        v, cross = solved[:, 0], solved[:, 1:]
        others = 0.5 * v @ v - np.log(np.diag(lower)).sum()
        spectrum, vectors = np.linalg.eigh(self.gram[np.ix_(own, own)] - cross.T @ cross)
        seen = (vectors.T @ (self.product[own] - cross.T @ v)) ** 2
        grown = 1.0 + np.outer(sizes**2, np.maximum(spectrum, 0.0))
        values = 0.5 * ((sizes**2)[:, None] * seen / grown - np.log(grown)).sum(axis=1)
        k = int(np.argmax(values))
        return float(others + values[k]), group, float(sizes[k])


def variance_gain(left: Array, weight: Array) -> float:
    """Gain of log probability if what is left has the variance 1 + (s weight)^2, at the best s.

    For what varies from sample to sample, which no smooth law follows.
    """
    weight = weight / max(float(np.max(np.abs(weight))), 1e-12)
    trials = [1.0 + (size * weight) ** 2 for size in SIZES]
    gains = [0.5 * np.sum(left**2 * (1.0 - 1.0 / v) - np.log(v)) for v in trials]
    return max(0.0, float(max(gains)) - float(np.log(len(SIZES))))
