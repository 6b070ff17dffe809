"""The relations of every run, reduced to what a law of one quantity needs.

    y_k = F_k theta + O_k omega_k + B_k beta + white noise

y_k are the rows of run k of the block regression: whitened parity relations, and drum speed over
its noise. theta are the nuisance columns that all runs share, omega_k those of the run alone, both
with unit priors. beta are the coefficients of terms. omega_k is integrated out: with
P = (1 + O O')^-1 all that a fit needs are the products X' P X and X' P y of X = [F B].

Other runs are the only judge of a term. Its held-out gain is the fall of the loss of every run,
with theta and beta fitted to the other runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
    from plant_emulator.diagnosis.localisation.marginal_likelihood import LinearModel
    from plant_emulator.diagnosis.missing_law.quantity import BenchQuantity
    from plant_emulator.signals.log import Array

# Prior standard deviation of a coefficient whose column was scaled to the length 1: none to speak
# of. It keeps a column solvable that a run does not show.
WIDE_PRIOR = 1e4
# Loss that a coefficient of a run's own must save: half of the logarithm of some thousand samples.
PRICE_OF_OWN = 4.0


@dataclass(frozen=True, eq=False)
class RunRows:
    """The rows of one run: y, columns that all runs share, and columns of its own."""

    y: Array
    shared: Array
    own: Array

    def project(self, columns: Array) -> tuple[Array, Array]:
        """X' P X and X' P y of the shared columns followed by these."""
        x = np.concatenate([self.shared, columns], axis=1)
        cross = self.own.T @ x
        mine = self.own.T @ self.y
        inner = np.eye(self.own.shape[1]) + self.own.T @ self.own
        solved = np.linalg.solve(inner, np.column_stack([cross, mine]))
        gram = x.T @ x - cross.T @ solved[:, :-1]
        return gram, x.T @ self.y - cross.T @ solved[:, -1]

    @property
    def loss(self) -> float:
        """Half of y' P y."""
        mine = self.own.T @ self.y
        inner = np.eye(self.own.shape[1]) + self.own.T @ self.own
        return float(0.5 * (self.y @ self.y - mine @ np.linalg.solve(inner, mine)))

    def squares(self, left: Array) -> Array:
        """Squares of a residual with the run's own coefficients fitted, and their price shared."""
        found = self._own_coefficients(left)
        return np.asarray((left - self.own @ found) ** 2 + found @ found / len(left))

    def without_own(self, left: Array) -> Array:
        """A residual with the run's own coefficients fitted."""
        return np.asarray(left - self.own @ self._own_coefficients(left))

    def _own_coefficients(self, left: Array) -> Array:
        inner = np.eye(self.own.shape[1]) + self.own.T @ self.own
        return np.asarray(np.linalg.solve(inner, self.own.T @ left))


def run_rows(regression: BlockRegression, model: LinearModel) -> list[RunRows]:
    """The rows of every run of a linear model of a regression, without terms."""
    columns = np.concatenate(model.nuisance, axis=1)
    places = run_slices(regression)
    shown = np.array(
        [[np.any(columns[rows, j]) for rows in places] for j in range(columns.shape[1])]
    )
    alone = shown.sum(axis=1) == 1
    return [
        RunRows(
            model.y[rows],
            columns[rows][:, ~alone],
            columns[rows][:, alone & shown[:, k]],
        )
        for k, rows in enumerate(places)
    ]


def run_slices(regression: BlockRegression) -> list[Array]:
    """Numbers of the rows of every run."""
    counts = [r.value.size for r in regression.relations] + [len(w) for w in regression.weights]
    ends = np.cumsum(counts)
    parts = [np.arange(end - count, end) for end, count in zip(ends, counts, strict=True)]
    runs = len(regression.relations)
    return [np.concatenate([parts[k], parts[runs + k]]) for k in range(runs)]


@dataclass(frozen=True, eq=False)
class LawRows:
    """The rows of all runs, and how laws of one quantity show in them.

    columns : run and values of laws at its states, shape (n, k), to their rows, shape (rows, k)
    """

    runs: Sequence[RunRows]
    columns: Callable[[int, Array], Array]

    def mapped(self, change: Callable[[int, Array], Array]) -> LawRows:
        """Rows that went through one more map; change : run and its rows, shape (rows, k)."""
        runs = [
            RunRows(change(k, one.y[:, None])[:, 0], change(k, one.shared), change(k, one.own))
            for k, one in enumerate(self.runs)
        ]
        return LawRows(runs, lambda run, values: change(run, self.columns(run, values)))

    def of(self, values: Sequence[Array]) -> list[Array]:
        """Rows of laws; values : in each run."""
        return [self.columns(k, own) for k, own in enumerate(values)]

    def null_loss(self) -> float:
        """Sum of the held-out losses of all runs without a law."""
        nothing = [np.zeros((len(own.y), 0)) for own in self.runs]
        return float(products(self.runs, nothing).held_out_losses(()).sum())


def law_rows(regression: BlockRegression, quantity: BenchQuantity) -> LawRows:
    """The rows of laws of a quantity of the bench."""

    def columns(run: int, values: Array) -> Array:
        relation, speed = quantity.rows(run, values)
        above = regression.relations[run].whiten(relation)
        weight = regression.weights[run]
        if speed is None:
            return np.concatenate([above, np.zeros((len(weight), above.shape[1]))])
        return np.concatenate([above, speed * weight[:, None]])

    return LawRows(run_rows(regression, quantity.model), columns)


@dataclass(frozen=True, eq=False)
class NuisanceProducts:
    """Products of the runs' nuisance columns and of terms.

    grams, products : X' P X and X' P y of each run; losses : half of y' P y
    shared : number of shared nuisance columns, which come first
    scale : length of each term's column in all runs, to which the products are scaled
    own : whether each run has a coefficient of its own of each term's column
    width : prior standard deviation of a term's coefficient, scaled
    """

    grams: Sequence[Array]
    products: Sequence[Array]
    losses: Sequence[float]
    shared: int
    scale: Array
    own: NDArray[np.bool_]
    width: float = WIDE_PRIOR

    def coefficients(self, chosen: Sequence[int], runs: Sequence[int]) -> Array:
        """Nuisance and shared coefficients of the chosen columns, fitted to some runs (scaled)."""
        systems = [self._reduce(chosen, k) for k in runs]
        gram = np.diag(self._precision(chosen)) + sum(one[0] for one in systems)
        return np.asarray(np.linalg.solve(gram, sum(one[1] for one in systems)))

    def covariance(self, chosen: Sequence[int], runs: Sequence[int]) -> Array:
        """Covariance of the chosen columns' shared coefficients (scaled)."""
        gram = np.diag(self._precision(chosen)) + sum(self._reduce(chosen, k)[0] for k in runs)
        return np.asarray(np.linalg.inv(gram)[self.shared :, self.shared :])

    def run_loss(self, chosen: Sequence[int], found: Array, run: int) -> float:
        """Loss of a run with these nuisance and shared coefficients, the run's own ones fitted."""
        gram, product, loss = self._reduce(chosen, run)
        return float(loss - product @ found + 0.5 * found @ gram @ found)

    def own_coefficients(self, chosen: Sequence[int], found: Array, run: int) -> Array:
        """The run's own coefficients of the chosen columns, fitted to it (scaled)."""
        shared, own = self._split(chosen)
        gram, product = self.grams[run], self.products[run]
        inner = gram[np.ix_(own, own)] + self.width**-2.0 * np.eye(len(own))
        return np.asarray(np.linalg.solve(inner, product[own] - gram[np.ix_(own, shared)] @ found))

    def left(
        self, chosen: Sequence[int], fitted: Sequence[int], run: int, rows: RunRows, columns: Array
    ) -> Array:
        """Residual of a run whose shared coefficients were fitted to some runs, shape (n,).

        columns : of all terms in the run, as they were given; the run's own nuisance is not fitted
        """
        shared, own = ([j for j in chosen if self.own[j] == alone] for alone in (False, True))
        found, scaled = self.coefficients(chosen, fitted), columns / self.scale
        left = rows.y - rows.shared @ found[: self.shared]
        left = left - scaled[:, shared] @ found[self.shared :]
        return np.asarray(left - scaled[:, own] @ self.own_coefficients(chosen, found, run))

    def held_out_losses(self, chosen: Sequence[int]) -> Array:
        """Loss of every run, with all shared coefficients fitted to the other runs."""
        runs = range(len(self.grams))
        return np.array(
            [
                self.run_loss(chosen, self.coefficients(chosen, [k for k in runs if k != run]), run)
                for run in runs
            ]
        )

    def _reduce(self, chosen: Sequence[int], run: int) -> tuple[Array, Array, float]:
        """Products of nuisance and shared columns, and loss, with the run's own ones fitted.

        Each coefficient of a run's own costs as much as chance would gain by it.
        """
        shared, own = self._split(chosen)
        gram, product = self.grams[run], self.products[run]
        if not len(own):
            return gram[np.ix_(shared, shared)], product[shared], self.losses[run]
        inner = gram[np.ix_(own, own)] + self.width**-2.0 * np.eye(len(own))
        cross = gram[np.ix_(own, shared)]
        solved = np.linalg.solve(inner, np.column_stack([cross, product[own]]))
        return (
            gram[np.ix_(shared, shared)] - cross.T @ solved[:, :-1],
            product[shared] - cross.T @ solved[:, -1],
            self.losses[run] - 0.5 * float(product[own] @ solved[:, -1]) + PRICE_OF_OWN * len(own),
        )

    def _split(self, chosen: Sequence[int]) -> tuple[Array, Array]:
        """Numbers of nuisance and shared columns, and of the run's own ones."""
        mine = np.array([*chosen], int)
        common = self.shared + mine[~self.own[mine]]
        return np.concatenate([np.arange(self.shared), common]), self.shared + mine[self.own[mine]]

    def _precision(self, chosen: Sequence[int]) -> Array:
        count = len(self._split(chosen)[0]) - self.shared
        return np.array([1.0] * self.shared + [self.width**-2.0] * count)


def products(
    rows: Sequence[RunRows], columns: Sequence[Array], own: Sequence[bool] | None = None
) -> NuisanceProducts:
    """Products of terms; columns : of every run, shape (rows, k); own : see `NuisanceProducts`."""
    length = np.sqrt(sum((one**2).sum(axis=0) for one in columns))
    scale = np.where(length > 0.0, length, 1.0)
    pairs = [one.project(part / scale) for one, part in zip(rows, columns, strict=True)]
    return NuisanceProducts(
        grams=[gram for gram, _ in pairs],
        products=[product for _, product in pairs],
        losses=[one.loss for one in rows],
        shared=rows[0].shared.shape[1],
        scale=scale,
        own=np.zeros(len(scale), bool) if own is None else np.array(own, bool),
    )
