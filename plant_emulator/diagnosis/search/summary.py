"""What the fitted sets of a search say of single effects."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import SearchStep
from plant_emulator.diagnosis.fitting.evidence import evidence_of
from plant_emulator.diagnosis.fitting.explanation import Hypothesis
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.screening.visibility import Visibility

    Sets = Mapping[frozenset[str], FitResult]


def hypotheses(sets: Sets, visible: Mapping[str, Visibility]) -> tuple[Hypothesis, ...]:
    """Join the visibility of each effect and its fit alone, if it was fitted."""
    singles = {next(iter(key)): one for key, one in sets.items() if len(key) == 1}
    return tuple(
        Hypothesis(effect=name, fit=singles.get(name), **vars(visibility))
        for name, visibility in visible.items()
    )


def not_told_apart(sets: Sets) -> list[FitResult]:
    """The best set of each size, and those of its size that may win in another noise."""
    kept = []
    for size in {len(key) for key in sets}:
        same = [one for key, one in sets.items() if len(key) == size]
        best = min(same, key=lambda one: one.cost)
        near = SETTINGS.near * max(1.0, best.mean_square)
        kept += [one for one in same if one.cost < best.cost + near]
    return kept


def alternatives(sets: Sets, final: FitResult, name: str) -> dict[str, float]:
    """Costs of the sets that have another effect in the place of this one [chi squared]."""
    others = frozenset(final.effects) - {name}
    return {
        next(iter(key - others)): one.cost
        for key, one in sets.items()
        if len(key) == len(final.effects) and key >= others
    }


def log_odds(
    sets: Sets,
    values: Mapping[frozenset[str], float],
    final: FitResult,
    larger: Mapping[str, float],
    margins: Mapping[str, float],
) -> float:
    """Log odds of a set against its best rival [nats], in the mean square that the set leaves.

    A set that these logs cannot tell from it is no rival. Sets that the search has dropped are not
    known any more.

    values : negative log evidence of each set
    larger : by how much it rises with one more effect, as the simulation's slopes predict, which
        are right beside a set that leaves noise; of an effect that was screened beside it
    margins : evidence up to which nothing tells another effect from one of the set
    """
    key, null = frozenset(final.effects), sets[frozenset()]
    rivals = [price for name, price in larger.items() if key | {name} not in sets]
    for names, one in sets.items():
        evidence = evidence_of(one.cost - final.cost, final, null)
        alike = len(names) == len(key) == len(names & key) + 1 and all(
            evidence < margins[name] for name in key - names
        )
        if names != key and not alike:
            rivals.append(values[names] - values[key])
    return min(rivals, default=0.0) / max(1.0, final.mean_square)


def search_step(
    null: FitResult, action: str, found: FitResult, promised: Mapping[str, float] | None = None
) -> SearchStep:
    """A step of the search that ended in this fit."""
    return SearchStep(
        action=action,
        effects=found.effects,
        promised=dict(promised or {}),
        gain=0.5 * (null.cost - found.cost),
        mean_square=found.mean_square,
    )


def unconverged(final: FitResult) -> str:
    """Tell that a fit did not converge; empty where it did."""
    those = " and ".join(final.effects) or "no effect"
    return "" if final.converged else f"the fit with {those} did not converge"
