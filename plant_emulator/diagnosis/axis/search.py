"""The search for effects: a queue over sets of at most three, by log evidence.

The evidence of a set is n/2 log(rows' variance without / with it), n the independent rows, less
log(n)/2 for each of its constants (G. Schwarz, Annals of Statistics 6 (1978) 461), and less
`needed` for each effect. A set with a size or a nominal parameter that physics forbids has none.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import SearchStep
from plant_emulator.diagnosis.axis.motion.run import UNCERTAIN
from plant_emulator.diagnosis.axis.regression.rows import Term
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.diagnosis.axis.start import grid

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.effects.effect import Effect, Scale
    from plant_emulator.diagnosis.axis.regression.fit import Fit, Regression

# Steps of a refinement of one shape, rounds over all shapes at most, and the relative fall of the
# cost below which a round is the last: a resonance is found by many small steps of its two shapes.
STEPS, ROUNDS, SETTLED = 12, 12, 1e-3
# Distance from a bound of a shape, in the logarithm, within which it lies at the bound.
AT_BOUND = 0.02


@dataclass
class AxisSearch:
    """The search in a regression; library : effects that apply to the runs."""

    regression: Regression
    candidates: Sequence[Effect]
    scale: Scale
    sets: dict[frozenset[str], Fit] = field(default_factory=dict)
    trace: list[SearchStep] = field(default_factory=list)

    def run(self) -> None:
        """Go through the queue; `best` then gives the best set."""
        self.sets[frozenset()] = self.regression.fit(())
        for size in range(SETTINGS.most_effects):
            before = self.believed()
            for found in [f for f in before if len(f.terms) == size][: SETTINGS.beam]:
                self._expand(found)
            if self.value(self.believed()[0]) >= self.value(before[0]):
                break

    @property
    def null(self) -> Fit:
        """The fit without effects."""
        return self.sets[frozenset()]

    def believed(self) -> list[Fit]:
        """The sets whose sizes can be believed, the largest evidence first."""
        found = [
            f
            for f in self.sets.values()
            if np.isfinite(self.value(f)) and not any(self.doubt(f, t) for t in f.terms)
        ]
        return sorted(found, key=self.value)

    @property
    def best(self) -> Fit:
        """The set of the largest evidence, or one that comes near and is more physical."""
        return self.alike(self.believed()[0])[0]

    def alike(self, found: Fit) -> list[Fit]:
        """Sets of as many effects whose evidence is not less by the margin, the set itself too.

        Laws of physics stand before descriptions in the library: their sets come first.
        """
        least = self.value(found) + SETTINGS.margin
        order = [effect.name for effect in self.candidates]
        near = [
            one
            for one in self.believed()
            if len(one.terms) == len(found.terms) and self.value(one) <= least
        ]
        return sorted(near, key=lambda one: sum(map(order.index, one.names)))

    def value(self, found: Fit) -> float:
        """Negative log evidence of a fit."""
        if any(self._forbidden(found, t) or _is_negative(found) for t in found.terms):
            return float("inf")
        count = self.regression.independent * found.count
        constants = sum(len(t.effect.sizes) + len(t.effect.shapes) for t in found.terms)
        spent = 0.5 * constants * np.log(count) + SETTINGS.needed * len(found.terms)
        return float(0.5 * count * np.log(found.cost / found.count) + spent)

    def doubt(self, found: Fit, term: Term) -> str:
        """Why the sizes of an effect cannot be believed; empty where they can."""
        name = term.effect.name
        sizes, errors = found.sizes(term)
        if self._forbidden(found, term):
            return f"{name} would do, but with a size that physics forbids"
        if len(sizes) and np.all(errors > np.abs(sizes)):
            return f"{name} would do, but no size of it is certain"
        for shape, value in zip(term.effect.shapes, term.shapes, strict=True):
            low, high = np.log(shape.bounds(self.scale))
            if not low + AT_BOUND < np.log(value) < high - AT_BOUND:
                return f"{name} would do, but its {shape.name} lies at its bound"
        return ""

    @staticmethod
    def _forbidden(found: Fit, term: Term) -> bool:
        """Whether a size is one that physics forbids, beyond its error."""
        sizes, errors = found.sizes(term)
        lowest = np.array([s.lowest for s in term.effect.sizes])
        highest = np.array([s.highest for s in term.effect.sizes])
        beyond = np.maximum(lowest - sizes, sizes - highest)
        return bool(len(sizes) and (np.any(beyond > UNCERTAIN * errors) or np.all(beyond > 0.0)))

    def gain(self, found: Fit) -> float:
        """Log evidence of a set over that of none."""
        return self.value(self.null) - self.value(found)

    def alternatives(self, found: Fit, name: str) -> tuple[str, ...]:
        """Effects that do as well in the place of this one."""
        others = frozenset(found.names) - {name}
        near = [
            (self.value(one), next(iter(key - others)))
            for key, one in self.sets.items()
            if len(key) == len(found.names) and key >= others
        ]
        least = min([self.value(found), *(v for v, _ in near)]) + SETTINGS.margin
        return tuple(n for v, n in sorted(near) if n != name and v <= least)

    def fit_set(self, names: Sequence[str]) -> Fit:
        """The fit of a set, its shapes refined."""
        key = frozenset(names)
        if key not in self.sets:
            found = self.null
            for effect in self.candidates:
                if effect.name in key:
                    found = self._added(found, effect)
            self.sets[key] = self.refined(found)
        return self.sets[key]

    def _expand(self, base: Fit) -> None:
        """Add each effect to a set; refine what comes near the best."""
        found = []
        for effect in self.candidates:
            key = frozenset((*base.names, effect.name))
            if effect.name in base.names or key in self.sets:
                continue
            self.sets[key] = self._added(base, effect)
            found.append(key)
        found.sort(key=lambda k: self.value(self.sets[k]))
        for key in found[: SETTINGS.beam]:
            if self.value(self.sets[key]) < self.value(base) + SETTINGS.margin:
                self.sets[key] = self.refined(self.sets[key])
                self.trace.append(self._step("confirmed", self.sets[key]))

    def _added(self, base: Fit, effect: Effect) -> Fit:
        """The best fit with one more effect, over the grid of its shapes."""
        fits = [
            self.regression.fit((*base.terms, Term(effect, s))) for s in grid(effect, self.scale)
        ]
        return min(fits, key=lambda f: f.cost)

    def refined(self, found: Fit) -> Fit:
        """The fit with its shapes refined one after the other, within their bounds."""
        for _ in range(ROUNDS):
            before = found.cost
            for k, term in enumerate(found.terms):
                for j in range(len(term.effect.shapes)):
                    found = self._refined(found, k, j)
            if found.cost >= (1.0 - SETTLED) * before:
                break
        return found

    def _refined(self, found: Fit, k: int, j: int) -> Fit:
        """The fit with one shape refined between its neighbours on the grid."""
        from scipy.optimize import minimize_scalar

        low, high = np.log(found.terms[k].effect.shapes[j].bounds(self.scale))
        middle, reach = np.log(found.terms[k].shapes[j]), (high - low) / (SETTINGS.grid - 1)

        def fit(x: float) -> Fit:
            return self.regression.fit(_moved(found.terms, k, j, float(np.exp(x))))

        best = minimize_scalar(
            lambda x: fit(x).cost,
            bounds=(max(low, middle - reach), min(high, middle + reach)),
            method="bounded",
            options={"maxiter": STEPS},
        )
        return fit(best.x) if best.fun < found.cost else found

    def _step(self, action: str, found: Fit) -> SearchStep:
        return SearchStep(
            action=action,
            effects=found.names,
            promised={},
            gain=self.gain(found),
            mean_square=found.cost / found.count,
        )


def _is_negative(found: Fit) -> bool:
    """Whether inertia, viscous or Coulomb friction is below 0, beyond its error."""
    errors = np.sqrt(np.maximum(np.diag(found.covariance), 0.0))
    return bool(np.any(found.values[:3] < -UNCERTAIN * errors[:3]))


def _moved(terms: Sequence[Term], k: int, j: int, value: float) -> tuple[Term, ...]:
    """Terms with one shape at another value."""
    shapes = list(terms[k].shapes)
    shapes[j] = value
    return (*terms[:k], Term(terms[k].effect, tuple(shapes)), *terms[k + 1 :])
