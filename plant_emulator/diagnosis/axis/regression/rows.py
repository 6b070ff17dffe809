"""The rows of a regression: the averaged force and the averaged laws of one run."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects.effect import Context
from plant_emulator.diagnosis.axis.motion.run import averaged_force

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.axis.effects.effect import Effect, Scale
    from plant_emulator.diagnosis.axis.motion.run import Base, Run
    from plant_emulator.signals.log import Array

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
class KnownEffect:
    """An effect of a parameter set.

    sizes : of the term, shape (sizes,); base, scale : of the axis that the sizes refer to
    """

    term: Term
    sizes: tuple[float, ...]
    base: Base
    scale: Scale


@dataclass
class Rows:
    """The rows of one run, and what was computed of them.

    use : rows that count; all columns are of these rows only
    known : effects of the parameter set, which act before all others
    """

    run: Run
    scale: Scale
    use: NDArray[np.bool_]
    known: tuple[KnownEffect, ...] = ()
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

    def logged(self) -> Array:
        """Averaged force of the log, less the load."""
        if "logged" not in self.cache:
            self.cache["logged"] = averaged_force(self.run.kernel, self.run.net)[self.use]
        return self.cache["logged"]

    def force(self, terms: Sequence[Term]) -> Array:
        """Averaged force that acts on the axis, less the load and the known effects."""
        replacing = [t for t in (*(k.term for k in self.known), *terms) if t.effect.replaced]
        key = ("force", *(t.key for t in replacing))
        if key not in self.cache:
            run, nodes = self.run, self.run.motion.time
            found = self.logged()
            if replacing:
                values = run.force(nodes)
                for term in replacing:
                    values = _replaced(term, nodes, values)
                found = self.average(values - (run.force(nodes) - run.net(nodes)))
            self.cache[key] = found - sum(map(self._known_force, self.known))
        return self.cache[key]

    def _known_force(self, one: KnownEffect) -> Array:
        """Averaged force of a known effect."""
        if one.term.effect.columns is None:
            return np.zeros(len(self.time))
        context = Context(motion=self.run.motion, base=one.base, scale=one.scale)
        found = one.term.effect.columns(context, one.term.values)
        return self.average(np.asarray(np.tensordot(one.sizes, np.stack(list(found)), 1)))

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
        key = ("columns", term.key, base if term.effect.refers else None)
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


def rows_of(run: Run, scale: Scale, known: tuple[KnownEffect, ...] = ()) -> Rows:
    """The rows of a run that count: neither at the start of the log, nor at rest.

    At rest the force is whatever holds the axis.
    """
    use = run.kernel.average(run.motion.slow.astype(float)) <= 0.5
    use &= run.kernel.rows >= LATEST * scale.period
    return Rows(run=run, scale=scale, use=use, known=known)


def _replacing(terms: Sequence[Term]) -> list[object]:
    return [t.key for t in terms if t.effect.replaced]
