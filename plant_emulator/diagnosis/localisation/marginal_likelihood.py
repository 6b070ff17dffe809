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

from plant_emulator.diagnosis.localisation.stacked_rows import NO_COLUMNS, GroupedColumns

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.signals.log import Array

# Sizes a_g that are tried.
GROUP_SIZES = np.geomspace(1e-2, 30.0, 9)
SIZES = np.append(0.0, GROUP_SIZES)
# The sizes of all groups are chosen again at most so many times.
MOST_SWEEPS = 3
# Another group, or another sweep, is worth this gain of log probability.
LEAST_LOG_GAIN = 0.5


@dataclass(frozen=True)
class MarginalLikelihood:
    """The largest marginal likelihood of a model.

    log : its logarithm
    mean : posterior mean of theta and beta, shape (k,)
    """

    log: float
    mean: Array


def log_marginal_likelihood(gram: Array, product: Array, deviations: Array) -> float:
    """v'v/2 - log det L of the module's text; deviations : diagonal of S."""
    lower = np.linalg.cholesky(_system(gram, deviations))
    v = np.linalg.solve(lower, deviations * product)
    return float(0.5 * v @ v - np.log(np.diag(lower)).sum())


def _system(gram: Array, deviations: Array) -> Array:
    return np.asarray(np.eye(len(gram)) + deviations[:, None] * gram * deviations)


class LinearModel:
    """Data y with the nuisance columns F, which are scaled to unit priors, in parts."""

    def __init__(self, y: Array, nuisance: Sequence[Array]) -> None:
        self.y, self.nuisance = y, tuple(nuisance)

    def left(self, rows: slice) -> float:
        """Sum of squares that the nuisance columns leave of these rows, with their penalty."""
        y, x = self.y[rows], np.concatenate([part[rows] for part in self.nuisance], axis=1)
        product = x.T @ y
        system = np.eye(x.shape[1]) + x.T @ x
        return float(y @ y - product @ np.linalg.solve(system, product))

    def marginal_likelihood(self, groups: Sequence[Array]) -> MarginalLikelihood:
        """The largest marginal likelihood over the sizes of these groups of columns."""
        return GroupRegression(self, groups).search.largest(range(len(groups)))


class GroupRegression:
    """A linear model with all groups of columns that it may take.

    groups : columns over all rows; laws : further groups, which come behind
    """

    def __init__(
        self, model: LinearModel, groups: Sequence[Array], laws: GroupedColumns = NO_COLUMNS
    ) -> None:
        self._dense = np.concatenate([*model.nuisance, model.y[:, None], *groups], axis=1)
        self._laws, self._known = laws, sum(part.shape[1] for part in model.nuisance)
        cross = laws.product(self._dense)
        products = np.block([[self._dense.T @ self._dense, cross.T], [cross, laws.gram]])
        widths = [*(group.shape[1] for group in groups), *laws.widths]
        self.search = SizeSearch(products, self._known, widths)

    def residual(self, mean: Array, chosen: Sequence[slice]) -> Array:
        """y without what these coefficients explain, in rows chosen of each of the first segments.

        mean : shape (k,); the result has the shape (n,)
        """
        dense, laws = np.split(mean, [self._dense.shape[1] - 1])
        explaining, found, begin = np.insert(-dense, self._known, 1.0), [], 0
        for (columns, numbers), rows in zip(self._laws.segments, chosen, strict=False):
            others = self._dense[begin : begin + len(columns)]
            found.append((others @ explaining - columns @ laws[numbers])[rows])
            begin += len(columns)
        return np.concatenate(found)


class SizeSearch:
    """The search for the sizes: first the group of the largest gain, then all taken ones anew.

    The nuisance coefficients are integrated out once for all sets of groups. What a group gains
    beside others is kept: the searches of several sets meet the same groups at the same sizes.

    products : X' X of the nuisance columns, y and the columns of all groups
    known : number of the nuisance columns; widths : number of columns of each group
    """

    def __init__(self, products: Array, known: int, widths: Sequence[int]) -> None:
        from scipy.sparse.csgraph import connected_components

        gram, cross, ones = products[:known, :known], products[:known, known:], np.ones(known)
        square = products[known, known]
        self._alone = log_marginal_likelihood(gram, cross[:, 0], ones) - 0.5 * square
        self._solved = np.linalg.solve(_system(gram, ones), cross)
        left = products[known:, known:] - cross.T @ self._solved
        self._gram, self._product = left[1:, 1:], left[1:, 0]
        ends = np.cumsum(widths)
        self._columns = [np.arange(end - n, end) for end, n in zip(ends, widths, strict=True)]
        begins, linked = [int(own[0]) for own in self._columns], self._gram != 0.0
        for axis in (0, 1) if widths else ():
            linked = np.logical_or.reduceat(linked, begins, axis=axis)
        # Groups of different parts have nothing to say of each other.
        self._parts = connected_components(linked)[1]
        self._gains: dict[tuple[object, ...], Array] = {}
        self._factored: tuple[dict[int, int], tuple[Array, Array, Array]] | None = None

    def largest(self, groups: Sequence[int]) -> MarginalLikelihood:
        """The largest marginal likelihood over the sizes of these groups, by their numbers."""
        taken: dict[int, int] = {}
        log = self._alone
        for _ in range(MOST_SWEEPS):
            gain = self._take_groups(groups, taken) + self._choose_again(groups, taken)
            log += gain
            if gain < LEAST_LOG_GAIN:
                break
        return MarginalLikelihood(log, self._mean(taken))

    def _take_groups(self, groups: Sequence[int], taken: dict[int, int]) -> float:
        """Take the group of the largest gain, until none is worth it; the gain of all."""
        whole = 0.0
        while absent := [k for k in groups if k not in taken]:
            gains = {k: self._gain(taken, k) for k in absent}
            best = max(absent, key=lambda k: float(gains[k].max()))
            if gains[best].max() <= LEAST_LOG_GAIN:
                break
            taken[best] = int(gains[best].argmax())
            whole += float(gains[best].max())
        return whole

    def _choose_again(self, groups: Sequence[int], taken: dict[int, int]) -> float:
        """Choose the size of each taken group again, which may leave it out; the gain of all."""
        whole = 0.0
        for k in [k for k in groups if k in taken]:
            gains = self._gain(taken, k)
            whole += float(gains.max() - gains[taken[k]])
            taken[k] = int(gains.argmax())
            if taken[k] == 0:
                del taken[k]
        return whole

    def _gain(self, taken: Mapping[int, int], group: int) -> Array:
        """Gain of a group beside the taken ones at each of the sizes 0 and GROUP_SIZES."""
        taken = {k: size for k, size in taken.items() if self._parts[k] == self._parts[group]}
        key = (group, *sorted(pair for pair in taken.items() if pair[0] != group))
        if key not in self._gains:
            own = self._columns[group]
            used, inverse, v = self._factor(taken)
            # The other groups are integrated out: a taken group's posterior tells its own.
            if group in taken:
                cross = inverse[:, np.isin(used, own)]
                precision = np.linalg.inv(cross.T @ cross)
                gram = precision - np.eye(len(own)) / SIZES[taken[group]] ** 2
                along = precision @ (cross.T @ v)
            else:
                cross = inverse @ self._gram[used[:, None], own]
                gram = self._gram[own[:, None], own] - cross.T @ cross
                along = self._product[own] - cross.T @ v
            self._gains[key] = _gains_by_size(gram, along)
        return self._gains[key]

    def _factor(self, taken: Mapping[int, int]) -> tuple[Array, Array, Array]:
        """Columns of the taken groups, and L^-1 and L^-1 X'y; L L' is the posterior precision."""
        from scipy.linalg.lapack import dtrtri

        if self._factored is None or self._factored[0] != taken:
            own = [self._columns[k] for k in taken]
            used = np.concatenate([np.zeros(0, int), *own])
            precision = self._gram[used[:, None], used]
            sizes = [np.full(len(c), SIZES[j]) for c, j in zip(own, taken.values(), strict=True)]
            precision[np.diag_indices(len(used))] += np.concatenate([np.zeros(0), *sizes]) ** -2.0
            lower = np.linalg.cholesky(precision)
            inverse = dtrtri(lower.T)[0].T if taken else lower
            self._factored = dict(taken), (used, inverse, inverse @ self._product[used])
        return self._factored[1]

    def _mean(self, taken: Mapping[int, int]) -> Array:
        """Posterior mean of all coefficients, shape (k,); 0 for groups that are not taken."""
        used, inverse, v = self._factor(taken)
        mean = np.zeros(len(self._product))
        mean[used] = inverse.T @ v
        return np.concatenate([self._solved[:, 0] - self._solved[:, 1:] @ mean, mean])


def _gains_by_size(gram: Array, along: Array) -> Array:
    """Gain of a group of columns at each of SIZES."""
    spectrum, vectors = np.linalg.eigh(gram)
    seen = (vectors.T @ along) ** 2
    variance = SIZES[:, None] ** 2
    grown = 1.0 + variance * np.maximum(spectrum, 0.0)
    return np.asarray(0.5 * (variance * seen / grown - np.log(grown)).sum(axis=1))


def variance_gain(residual: Array, weight: Array) -> float:
    """Largest gain of log probability if a residual has the variance 1 + (s weight)^2.

    It covers what varies from sample to sample, which no smooth law follows.
    """
    weight = weight / max(float(np.max(np.abs(weight))), 1e-12)
    trials = [1.0 + (size * weight) ** 2 for size in GROUP_SIZES]
    gains = [0.5 * np.sum(residual**2 * (1.0 - 1.0 / v) - np.log(v)) for v in trials]
    return max(0.0, float(max(gains)) - float(np.log(len(GROUP_SIZES))))
