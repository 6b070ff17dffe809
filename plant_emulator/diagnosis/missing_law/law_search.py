"""The search for the laws that close most of the gap in runs that they were not fitted to.

A law is a sum of one to three terms of one quantity. The first term is the one with the largest
held-out gain; each next one must close a worthwhile share more. Rivals are laws over other states,
or of other quantities, that come near.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.missing_law.grammar import Term, terms
from plant_emulator.diagnosis.missing_law.reduced import products

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
    from plant_emulator.diagnosis.missing_law.reduced import LawRows, NuisanceProducts
    from plant_emulator.signals.log import Array

# Most terms of a law.
MOST_TERMS = 3
# Laws of one term that further terms are tried with.
EXTENDED_LAWS = 6
# Another term must raise the held-out gain by this [twice the log of the odds].
LEAST_TERM_GAIN = 25.0
# A law is drafted from this held-out gain on [twice the log of the odds]. Runs without any gap gave
# up to 60, because the drum's flight through the gap is linearised.
DRAFTED_GAIN = 100.0
# Correlation from which on two laws have the same shape: they differ by a tenth of their size.
SAME_SHAPE = 0.995
# A factor more costs this [as above]: of two terms that say the same, the shorter one counts.
PRICE_OF_FACTOR = 5.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Law:
    """A law of a quantity: the sum of coefficients times terms.

    coefficients, errors : of each term [unit of the quantity over that of the term]
    gain : fall of twice the loss of every run, with the law fitted to the other runs
    nuisance : coefficients of the columns that all runs share beside the law
    phases : of the angles in each run, by name in the effect file [rad]
    """

    quantity: LawQuantity
    terms: tuple[Term, ...]
    coefficients: tuple[float, ...]
    errors: tuple[float, ...]
    gain: float
    nuisance: tuple[float, ...]
    phases: tuple[Mapping[str, float], ...] = ()

    def over_state(self, name: str, knots: Array) -> Array | None:
        """Values of the law at values of this state; None: it depends on more than the state."""
        if any(
            factor.state.name != name or factor.function in {"delay", "lag", "turn", "play"}
            for term in self.terms
            for factor in term.factors
        ):
            return None
        found = np.zeros(len(knots))
        for size, term in zip(self.coefficients, self.terms, strict=True):
            at = [
                replace(f, state=replace(f.state, values=[knots], time=[knots]))
                for f in term.factors
            ]
            found = found + size * Term(tuple(at)).values(0, len(knots))[:, 0]
        return found

    def resembles(self, other: Law) -> bool:
        """Whether the other law is hardly another one: of the same functions, or the same shape.

        The shape is that in all runs, apart from a constant: friction and offset of the bench take
        a constant.
        """
        if self.quantity.name != other.quantity.name:
            return False
        if self._functions == other._functions and self._turns_like(other):
            return True
        if any(term.own for term in (*self.terms, *other.terms)):
            return False
        one, two = (law.values - law.values.mean() for law in (self, other))
        size = np.linalg.norm(one) * np.linalg.norm(two)
        return bool(abs(one @ two) >= SAME_SHAPE * size)

    @property
    def _functions(self) -> frozenset[tuple[str, str]]:
        """Functions and states of the law, without scales."""
        return frozenset((f.function, f.state.name) for term in self.terms for f in term.factors)

    def _turns_like(self, other: Law) -> bool:
        """Whether no run tells a multiple of the other law from the nearest one of this law."""
        mine, others = (
            {f.scale: f.state for term in law.terms for f in term.factors if f.function == "turn"}
            for law in (self, other)
        )
        return all(
            min(abs(k - own) for own in mine) * max(map(np.ptp, state.values)) < np.pi
            for k, state in others.items()
        )

    @property
    def values(self) -> Array:
        """Values over the intervals of all runs, shape (n,); 0 for a term of an angle."""
        counts = [len(own) for own in self.quantity.states[0].values]
        found = [np.zeros(count) for count in counts]
        for size, term in zip(self.coefficients, self.terms, strict=True):
            if not term.own:
                for run, count in enumerate(counts):
                    found[run] += size * term.values(run, count)[:, 0]
        return np.concatenate(found)

    @property
    def text(self) -> str:
        """The law as text, with unit."""
        parts = [
            f"{c:+.3g} {t.text}".strip() for c, t in zip(self.coefficients, self.terms, strict=True)
        ]
        return f"{' '.join(parts).removeprefix('+')} {self.quantity.unit}"

    def with_fitted_sizes(self, values: Mapping[str, float]) -> Law:
        """The law with the sizes, widths and time constants of a fit, as `effect_text` names them.

        values : by name, as `a1` and `b12`
        """
        changed = tuple(
            Term(
                tuple(
                    replace(factor, scale=values.get(f"b{k}{j}", factor.scale))
                    for j, factor in enumerate(term.factors, 1)
                )
            )
            for k, term in enumerate(self.terms, 1)
        )
        sizes = tuple(values.get(f"a{k}", a) for k, a in enumerate(self.coefficients, 1))
        return replace(self, terms=changed, coefficients=sizes)

    @property
    def over(self) -> tuple[str, ...]:
        """Names of the states that the law depends on."""
        return tuple(dict.fromkeys(state.name for term in self.terms for state in term.states))


@dataclass(frozen=True, eq=False)
class LawSearch:
    """The search in one quantity; null : sum of the held-out losses of all runs without a law."""

    quantity: LawQuantity
    rows: LawRows
    terms: Sequence[Term]
    products: NuisanceProducts
    null: float

    def score(self, chosen: Sequence[int]) -> float:
        """Held-out gain of these terms, less the price of their factors."""
        factors = sum(len(self.terms[j].factors) for j in chosen)
        return self.gain(chosen) - PRICE_OF_FACTOR * factors

    def gain(self, chosen: Sequence[int]) -> float:
        """Held-out gain of these terms."""
        return float(2.0 * (self.null - self.products.held_out_losses(self._columns(chosen)).sum()))

    def left(self, chosen: Sequence[int]) -> list[Array]:
        """What the law of these terms leaves of the rows of each run, fitted to all of them."""
        every = range(len(self.rows.runs))
        columns, p = columns_of(self.rows, self.quantity, [self.terms[j] for j in chosen])
        return [
            one.without_own(p.left(range(len(p.own)), every, k, one, columns[k]))
            for k, one in enumerate(self.rows.runs)
        ]

    def _columns(self, chosen: Sequence[int]) -> list[int]:
        """Numbers of the columns of these terms: a turn has two."""
        widths = [2 if term.own else 1 for term in self.terms]
        ends = np.cumsum(widths)
        return [int(c) for j in chosen for c in range(ends[j] - widths[j], ends[j])]

    def singles(self) -> list[tuple[int, ...]]:
        """All laws of one term, the best one first."""
        return sorted(((j,) for j in range(len(self.terms))), key=self.score, reverse=True)

    def list_nested(self) -> list[tuple[int, ...]]:
        """The best law of one term, and longer ones as long as another term counts."""
        starts = self.singles()[:EXTENDED_LAWS]
        found = [starts[0]]
        while len(found) < min(MOST_TERMS, len(self.terms)):
            longer = [
                (*start, j) for start in starts for j in range(len(self.terms)) if j not in start
            ]
            best = max(longer, key=self.score)
            if self.score(best) <= self.score(found[-1]) + LEAST_TERM_GAIN:
                break
            found.append(best)
            starts = [best]
        return found

    def law(self, chosen: Sequence[int]) -> Law:
        """The law with these terms, fitted to all runs."""
        p, every = self.products, range(len(self.products.grams))
        columns = self._columns(chosen)
        found = p.coefficients(columns, every)
        errors = np.sqrt(np.diag(p.covariance(columns, every)))
        shared = iter(zip(found[p.shared :], errors, strict=True))
        mine = [j for j in columns if p.own[j]]
        turns = np.array([p.own_coefficients(columns, found, k) / p.scale[mine] for k in every])
        sizes, deviations, at = [], [], 0
        phases: list[dict[str, float]] = [{} for _ in every]
        for k, j in enumerate(chosen, 1):
            if self.terms[j].own:
                cosine, sine = turns[:, at : at + 2].T
                amplitudes = np.hypot(cosine, sine)
                sizes.append(float(np.mean(amplitudes)))
                deviations.append(float(np.std(amplitudes)))
                for own, phase in zip(phases, np.arctan2(-sine, cosine), strict=True):
                    own[f"phase{k}{self.terms[j].turn}"] = float(phase)
                at += 2
                continue
            first = self._columns([j])[0]
            size, error = next(shared)
            sizes.append(float(size / p.scale[first]))
            deviations.append(float(error / p.scale[first]))
        return Law(
            quantity=self.quantity,
            terms=tuple(self.terms[j] for j in chosen),
            coefficients=tuple(sizes),
            errors=tuple(deviations),
            gain=self.gain(chosen),
            nuisance=tuple(found[: p.shared].tolist()),
            phases=tuple(phases),
        )


def search(rows: LawRows, quantity: LawQuantity, null: float) -> LawSearch:
    """Prepare the search in a quantity; null : see `LawSearch`."""
    every = terms(quantity.states)
    return LawSearch(quantity, rows, every, columns_of(rows, quantity, every)[1], null)


def columns_of(
    rows: LawRows, quantity: LawQuantity, every: Sequence[Term]
) -> tuple[list[Array], NuisanceProducts]:
    """Columns of terms in the rows of each run, and their products."""
    values = [
        np.concatenate([term.values(k, len(own)) for term in every], axis=1)
        for k, own in enumerate(quantity.states[0].values)
    ]
    own = [term.own for term in every for _ in range(2 if term.own else 1)]
    columns = rows.of(values)
    return columns, products(rows.runs, columns, own)
