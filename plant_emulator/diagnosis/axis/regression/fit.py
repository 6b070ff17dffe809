"""One regression: the averaged force over the averaged laws.

Nominal parameters, the friction level of each run, and the sizes of effects enter linearly. The
kernel keeps the noise of the motion below that of the force, so that the rows weigh alike. An axis
is modelled in outline: what is left is correlated, and counts by its independent share, which is
estimated on what a rich model leaves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.motion.run import Base
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.estimation.covariance import correlation_time

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.regression.rows import Rows, Term
    from plant_emulator.signals.log import Array

# Fits at most around the nominal parameters of the fit before, and the relative change of the cost
# from which on a further one changes nothing.
REFERENCES, SETTLED = 6, 1e-3
NAMES = ("inertia", "viscous_friction", "coulomb_friction", "offset")


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A fit of nominal parameters, friction levels and sizes.

    values : NAMES, then the sizes term by term; covariance : of `values`
    reference : nominal parameters that the terms refer to
    levels : own friction and inertia of each fitted run beyond the common ones [1]
    cost : squares with the priors' penalty; count : rows
    """

    terms: tuple[Term, ...]
    values: Array
    covariance: Array
    reference: Base
    levels: tuple[Array, ...]
    cost: float
    count: int

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(t.effect.name for t in self.terms)

    @property
    def base(self) -> Base:
        """The nominal parameters."""
        inertia, viscous, coulomb, offset = map(float, self.values[: len(NAMES)])
        return Base(inertia=inertia, viscous=viscous, coulomb=coulomb, offset=offset)

    def place(self, term: Term) -> int:
        """Place of a term's first size among the values."""
        before = self.terms[: self.terms.index(term)]
        return len(NAMES) + sum(len(t.effect.sizes) for t in before)

    def sizes(self, term: Term) -> tuple[Array, Array]:
        """Sizes of a term, and their standard errors."""
        part = slice(self.place(term), self.place(term) + len(term.effect.sizes))
        return self.values[part], np.sqrt(np.maximum(np.diag(self.covariance)[part], 0.0))


@dataclass(frozen=True, kw_only=True)
class Regression:
    """The regression of some runs.

    base : nominal parameters that a run's own ones refer to, and the terms of a linear fit
    variance : of what a rich model leaves; independent : share of the rows that are, there
    spread : prior deviation of a run's own friction and inertia [1]; 0: no own one
    """

    rows: Sequence[Rows]
    base: Base
    variance: float = 0.0
    independent: float = 1.0
    spread: tuple[float, float] = (SETTINGS.friction_spread, 0.0)

    def fit(self, terms: Sequence[Term]) -> Fit:
        """Fit these terms around the nominal parameters of the fit itself.

        A law of the force or of the friction is one of the parameters that stand beside it. Those
        of another fit leave a force that a further effect would explain.
        """
        best = found = self.linear(terms, self.base)
        for _ in range(REFERENCES if any(t.effect.refers for t in terms) else 0):
            before, found = found, self.linear(terms, found.base)
            best = min(best, found, key=lambda one: one.cost)
            if abs(found.cost - before.cost) <= SETTLED * before.cost:
                break
        return best

    def linear(self, terms: Sequence[Term], reference: Base) -> Fit:
        """Fit these terms; reference : nominal parameters that they refer to."""
        own = sum(s > 0.0 for s in self.spread) if len(self.rows) > 1 else 0
        shared = len(NAMES) + sum(len(t.effect.sizes) for t in terms)
        size = shared + own * len(self.rows)
        information, projected, square = np.zeros((size, size)), np.zeros(size), 0.0
        for k, rows in enumerate(self.rows):
            a, b = rows.design(terms, reference), rows.force(terms)
            a = np.concatenate([a, rows.own(self.base)[:, :own]], axis=1)
            first = shared + own * k
            place = [*range(shared), *range(first, first + own)]
            information[np.ix_(place, place)] += a.T @ a
            projected[place] += a.T @ b
            square += float(b @ b)
        precision = np.zeros(size)
        if own:
            precision[shared:] = np.tile(self._stiffness[:own], len(self.rows))
        values, inverse = _solved(information + np.diag(precision), projected)
        count = sum(len(r.time) for r in self.rows)
        cost = float(square - values @ projected)
        if any(t.effect.replaced for t in terms):
            cost += sum(rows.noise(()) - rows.noise(terms) for rows in self.rows)
        scatter = cost / max(1, count - size) / self.independent
        levels = values[shared:].reshape(-1, own) if own else np.zeros((len(self.rows), 0))
        return Fit(
            terms=tuple(terms),
            values=values[:shared],
            covariance=inverse[:shared, :shared] * scatter,
            reference=reference,
            levels=tuple(levels),
            cost=cost,
            count=count,
        )

    @property
    def _stiffness(self) -> Array:
        """Precision of the own columns, in squares of the rows."""
        scatter = self.variance / self.independent
        return np.array([scatter / s**2 for s in self.spread if s > 0.0])

    def residual(self, found: Fit, k: int) -> Array:
        """Force that a fit does not explain in a fitted run, shape (rows,)."""
        return residual(self.rows[k], found, self.base, found.levels[k])

    def in_noise_of(self, found: Fit) -> Regression:
        """The regression in the noise that a fit leaves, around its nominal parameters."""
        left = [self.residual(found, k) for k in range(len(self.rows))]
        return replace(
            self,
            base=found.base,
            variance=float(np.mean(np.concatenate(left) ** 2)),
            # A slow run has few independent rows, and takes none away from the other runs.
            independent=sum(len(e) / correlation_time(e) for e in left) / sum(map(len, left)),
        )

    def around(self, found: Fit) -> Regression:
        """The regression around the nominal parameters of a fit."""
        return replace(self, base=found.base)

    def own_level(self, rows: Rows, found: Fit) -> Array:
        """Own friction and inertia of a run that was not fitted, all else kept."""
        own = len(found.levels[0])
        if not own:
            return np.zeros(0)
        left, columns = residual(rows, found, self.base, np.zeros(0)), rows.own(self.base)[:, :own]
        return _solved(columns.T @ columns + np.diag(self._stiffness[:own]), columns.T @ left)[0]


def residual(rows: Rows, found: Fit, base: Base, level: Array) -> Array:
    """Averaged force less what a fit explains, shape (rows,) [N or N m].

    base : that the run's own values refer to; level : these values
    """
    predicted = rows.design(found.terms, found.reference) @ found.values
    own = rows.own(base)[:, : len(level)] @ level
    return np.asarray(rows.force(found.terms) - predicted - own)


def _solved(information: Array, projected: Array) -> tuple[Array, Array]:
    """Solution and inverse of normal equations, scaled; 0 in directions without information."""
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = values > 1e-11 * values[-1]
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T / np.outer(scale, scale)
    return inverse @ projected, inverse
