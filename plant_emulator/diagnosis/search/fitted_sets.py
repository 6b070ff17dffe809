"""The sets of effects that a search has fitted, and which of them the logs ask for most.

The log evidence of a set is half the fall of its penalised cost, less the gain that each of its
effects needs. A set whose last effect the runs do not confirm (`run_agreement`) has none: that
effect stands for the error of another one's law.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import excess
from plant_emulator.diagnosis.fitting.fit_steps import refit
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.confirmation import Reduction, confirm, trial_of
from plant_emulator.diagnosis.search.run_agreement import run_agreement
from plant_emulator.diagnosis.search.settings import SETTINGS
from plant_emulator.diagnosis.search.summary import search_step

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from plant_emulator.diagnosis.answer import SearchStep
    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.promise import Promise


@dataclass(kw_only=True)
class FittedSets:
    """The fitted sets of effects; see the module's text.

    runner : in whose noise the costs count; null : fit without effects
    beside_random : whether a random effect is part of that noise
    sets : the best fit of each set; confirmed : whether the runs confirm it, where they were asked
    promises : what one more effect promises on top of a set
    expanded : sets whose most promising effects were fitted on top of them
    """

    runner: TaskRunner
    null: FitResult
    beside_random: bool = False
    sets: dict[frozenset[str], FitResult] = field(default_factory=dict)
    confirmed: dict[frozenset[str], bool] = field(default_factory=dict)
    promises: dict[frozenset[str], list[Promise]] = field(default_factory=dict)
    expanded: set[frozenset[str]] = field(default_factory=set)
    trace: list[SearchStep] = field(default_factory=list)

    def task(self, base: FitResult) -> Task:
        """A fit, and the runs of the search."""
        return Task(base=base, runs=self.runner.runs)

    def fits(
        self, step: Callable[[Model, Task], FitResult], bases: Iterable[FitResult]
    ) -> list[FitResult]:
        """Run a step on each fit, and keep each result under its set of effects."""
        found = list(self.runner.map(step, [self.task(base) for base in bases]))
        self.sets |= {frozenset(one.effects): one for one in found}
        return found

    def take_null(self, null: FitResult) -> None:
        """Take a better fit without effects in the place of the known one."""
        self.trace.append(search_step(self.null, "fitted anew", null))
        self.null = self.sets[frozenset()] = null
        self.promises.pop(frozenset(), None)

    def confirm(self, base: FitResult, new: Sequence[Promise], iterations: int) -> list[FitResult]:
        """Fit these effects on top of a set, each for at most so many iterations."""
        trials = [trial_of(p, base, self.runner.runs, iterations) for p in new]
        found = list(self.runner.map(confirm, trials))
        for promise, one in zip(new, found, strict=True):
            self.keep(one)
            self.trace.append(search_step(self.null, "confirmed", one, promise.gains))
        return found

    def keep(self, found: FitResult) -> None:
        """Keep a fit if it is the best one of its set."""
        key = frozenset(found.effects)
        if key not in self.sets or found.cost < self.sets[key].cost:
            self.sets[key] = found

    def needed(self, others: int) -> float:
        """Least gain of log evidence that an effect needs beside so many others."""
        return SETTINGS.needed_again if others or self.beside_random else SETTINGS.needed

    def value(self, found: FitResult) -> float:
        """Negative log evidence of a set, with the gain that each of its effects needs.

        It is infinite where the runs do not confirm an effect.
        """
        if not self.confirmed.get(frozenset(found.effects), True):
            return inf
        return 0.5 * found.cost + sum(map(self.needed, range(len(found.effects))))

    def settled(self) -> FitResult:
        """Refit all sets near the best one until they converge; return the best.

        What the best one leaves beyond the noise a set may explain whose fit has not ended. A set
        with an effect that the runs do not confirm is none.
        """
        done: set[frozenset[str]] = set()
        while True:
            best = min(self.sets.values(), key=self.value)
            near = [
                one
                for one in self.sets.values()
                if frozenset(one.effects) not in done
                and len(one.effects) == max(1, len(best.effects))
                and one.cost < best.cost + SETTINGS.near + (not one.converged) * excess(best)
            ]
            if not near and self.is_confirmed(best):
                return best
            for one in self.fits(refit, near):
                done.add(frozenset(one.effects))
                self.trace.append(search_step(self.null, "converged", one))

    def is_confirmed(self, found: FitResult) -> bool:
        """Whether the runs confirm the last effect of a set as more than the error of others' laws.

        Where they do not, another one may take its place. An effect that a single run shows has
        nothing to agree with, and must close more than such errors leave.
        """
        key, base = frozenset(found.effects), frozenset(found.effects[:-1])
        if len(key) > 1 and key not in self.confirmed:
            smaller, library = self.sets.get(base, self.null), self.runner.model.candidates
            approximate = any(not library[name].exact_form for name in smaller.effects)
            least = SETTINGS.law_error**2 * approximate * (self.null.cost - smaller.cost)
            asked = Reduction(found, self.runner.runs, found.effects[-1])
            (said,) = self.runner.map(run_agreement, [asked])
            self.confirmed[key] = said.probability >= SETTINGS.agreement and (
                said.runs > 1 or smaller.cost - found.cost >= least
            )
            if not self.confirmed[key]:
                self.trace.append(search_step(self.null, "the runs do not confirm it", found))
                self.expanded.discard(base)
        return self.confirmed.get(key, True)
