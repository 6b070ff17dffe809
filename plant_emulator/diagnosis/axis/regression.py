"""One regression: the averaged force over the averaged laws.

Nominal parameters, the friction level of each run, and the sizes of effects enter linearly. The
kernel keeps the noise of the motion below that of the force, so that the rows weigh alike. An axis
is modelled in outline: what is left is correlated, and counts by its independent share, which is
estimated on what a rich model leaves.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects.effect import Context
from plant_emulator.diagnosis.axis.motion import Base, averaged_force
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.estimation.covariance import correlation_time

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.axis.effects.effect import Effect, Scale
    from plant_emulator.diagnosis.axis.motion import Run
    from plant_emulator.signals.log import Array

NAMES = ("inertia", "viscous_friction", "coulomb_friction", "offset")
# The longest delay that is tried, in periods: the rows before it do not count.
LATEST = 20


@dataclass(frozen=True)
class Term:
    """An effect with its shapes."""

    effect: Effect
    shapes: tuple[float, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Shapes by name."""
        return dict(zip((s.name for s in self.effect.shapes), self.shapes, strict=True))

    @property
    def key(self) -> tuple[str, tuple[float, ...]]:
        """Key of its columns."""
        return self.effect.name, self.shapes


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A fit of nominal parameters, friction levels and sizes.

    values : NAMES, then the sizes term by term; covariance : of `values`
    levels : own friction and inertia of each fitted run beyond the common ones [1]
    cost : squares with the priors' penalty; count : rows
    """

    terms: tuple[Term, ...]
    values: Array
    covariance: Array
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


@dataclass
class Rows:
    """The rows of one run, and what was computed of them.

    use : rows that count; all columns are of these rows only
    """

    run: Run
    scale: Scale
    use: NDArray[np.bool_]
    cache: dict[object, Array] = field(default_factory=dict)

    @property
    def time(self) -> Array:
        """Middle of each row that counts [s]."""
        return self.run.kernel.rows[self.use]

    def average(self, law: Array) -> Array:
        """Averaged law, shape (rows,)."""
        return self.run.kernel.average(law)[self.use]

    def chance(self, terms: Sequence[Term]) -> Array:
        """White noise of the force, of deviation 1: a delay or lag takes a part of it away."""
        key = ("chance", *_replacing(terms))
        if key not in self.cache:
            from scipy.interpolate import make_interp_spline

            time = self.run.kernel.time
            noise = make_interp_spline(
                time, np.random.default_rng(1).standard_normal(len(time)), k=5
            )
            white = replace(self.run, force=noise, net=noise)
            self.cache[key] = Rows(run=white, scale=self.scale, use=self.use).force(terms)
        return self.cache[key]

    def noise(self, terms: Sequence[Term]) -> float:
        """Squares of the force's noise in these rows."""
        chance = self.chance(terms)
        return float(self.run.force_noise**2 * (chance @ chance))

    def force(self, terms: Sequence[Term]) -> Array:
        """Averaged force that acts on the axis, less the load."""
        replacing = [t for t in terms if t.effect.replaced]
        key = ("force", *(t.key for t in replacing))
        if key not in self.cache:
            run, nodes = self.run, self.run.motion.time
            found = averaged_force(run.kernel, run.net)[self.use]
            if replacing:
                values = run.force(nodes)
                for term in replacing:
                    values = _replaced(term, nodes, values)
                found = self.average(values - (run.force(nodes) - run.net(nodes)))
            self.cache[key] = found
        return self.cache[key]

    def nominal(self) -> Array:
        """Columns of the nominal parameters."""
        if "nominal" not in self.cache:
            run, m = self.run, self.run.motion
            laws = (m.velocity, m.direction, np.ones(len(m.time)))
            inertia = run.kernel.acceleration(run.measured)[self.use]
            self.cache["nominal"] = np.stack([inertia, *map(self.average, laws)], axis=1)
        return self.cache["nominal"]

    def own(self, base: Base) -> Array:
        """Columns of the run's own friction and inertia, in those of the axis; shape (rows, 2)."""
        nominal = self.nominal()
        friction = base.viscous * nominal[:, 1] + base.coulomb * nominal[:, 2]
        return np.stack([friction, base.inertia * nominal[:, 0]], axis=1)

    def columns(self, term: Term, base: Base) -> Array:
        """Columns of an effect's sizes, shape (rows, sizes)."""
        if term.effect.columns is None:
            return np.zeros((int(self.use.sum()), 0))
        key = ("columns", term.key, base)
        if key not in self.cache:
            context = Context(motion=self.run.motion, base=base, scale=self.scale)
            found = term.effect.columns(context, term.values)
            self.cache[key] = np.stack([self.average(np.asarray(c)) for c in found], axis=1)
        return self.cache[key]

    def design(self, terms: Sequence[Term], base: Base) -> Array:
        """All columns without the friction level, shape (rows, values)."""
        return np.concatenate([self.nominal(), *(self.columns(t, base) for t in terms)], axis=1)


def _replaced(term: Term, nodes: Array, values: Array) -> Array:
    """Force at the nodes after a delay or a lag of the force before."""
    from scipy.interpolate import make_interp_spline

    assert term.effect.replaced is not None
    return term.effect.replaced(make_interp_spline(nodes, values, k=3), nodes, term.values)


def rows_of(run: Run, scale: Scale) -> Rows:
    """The rows of a run that count: neither at the start of the log, nor at rest.

    At rest the force is whatever holds the axis.
    """
    use = run.kernel.average(run.motion.slow.astype(float)) <= 0.5
    use &= run.kernel.rows >= LATEST * scale.period
    return Rows(run=run, scale=scale, use=use)


@dataclass(frozen=True, kw_only=True)
class Regression:
    """The regression of some runs.

    base : nominal parameters that effects refer to
    variance : of what a rich model leaves; independent : share of the rows that are, there
    spread : prior deviation of a run's own friction and inertia [1]; 0: no own one
    """

    rows: Sequence[Rows]
    base: Base
    variance: float = 0.0
    independent: float = 1.0
    spread: tuple[float, float] = (SETTINGS.friction_spread, 0.0)

    def fit(self, terms: Sequence[Term]) -> Fit:
        """Fit these terms."""
        own = sum(s > 0.0 for s in self.spread) if len(self.rows) > 1 else 0
        shared = len(NAMES) + sum(len(t.effect.sizes) for t in terms)
        size = shared + own * len(self.rows)
        information, projected, square = np.zeros((size, size)), np.zeros(size), 0.0
        for k, rows in enumerate(self.rows):
            a, b = rows.design(terms, self.base), rows.force(terms)
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

    level : the run's own values
    """
    predicted = rows.design(found.terms, base) @ found.values
    own = rows.own(base)[:, : len(level)] @ level
    return np.asarray(rows.force(found.terms) - predicted - own)


def _solved(information: Array, projected: Array) -> tuple[Array, Array]:
    """Solution and inverse of normal equations, scaled; 0 in directions without information."""
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = values > 1e-11 * values[-1]
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T / np.outer(scale, scale)
    return inverse @ projected, inverse


def _replacing(terms: Sequence[Term]) -> list[object]:
    return [t.key for t in terms if t.effect.replaced]
