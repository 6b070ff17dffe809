"""The sets of effects that a search has fitted, and which of them the logs ask for most.

The log evidence of a set is half the fall of its penalised cost, less the gain that each of its
effects needs. A set is refuted where a further effect stands for the error of the others' laws: the
runs do not agree on its size (`run_agreement`), or it gains little where these laws may have
another form (`law_forms`). So is each set that holds it, and each last effect that gains no more
beside the same others. What is left of it without one effect is fitted then. A set with an effect
that gains by few samples only is refuted too (`gain_spread`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import CLASS_MARGIN, excess
from plant_emulator.diagnosis.fitting.fit_steps import refit, refit_along
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.confirmation import (
    Reduction,
    reduce,
    without_effects,
)
from plant_emulator.diagnosis.search.gain_spread import Pair, shared_gain
from plant_emulator.diagnosis.search.law_forms import gain_beside_forms
from plant_emulator.diagnosis.search.run_agreement import run_agreement
from plant_emulator.diagnosis.search.summary import search_step
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from plant_emulator.diagnosis.answer import SearchStep
    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.screening.promise import Promise


@dataclass(kw_only=True)
class FittedSets:
    """The fitted sets of effects; see the module's text.

    runner : in whose noise the costs count; null : fit without effects
    led_null : fit without effects along the measured outputs, to begin at: its cost may be that in
        another noise. None: null leads there
    beside_random : whether a random effect is part of that noise
    sets : the best fit of each set, at first of those that are known
    agreed : whether the runs and other forms of the laws agree on it, where they were asked
    shared : whether enough samples share the gain of its effects, where they were asked
    promises : what one more effect promises on top of a set
    led_fits : along the measured outputs, of sets on top of which others were tried
    expanded : sets whose most promising effects were tried on top of them
    """

    runner: TaskRunner
    null: FitResult
    led_null: FitResult | None = None
    beside_random: bool = False
    sets: dict[frozenset[str], FitResult] = field(default_factory=dict)
    agreed: dict[frozenset[str], bool] = field(default_factory=dict)
    shared: dict[frozenset[str], bool] = field(default_factory=dict)
    promises: dict[frozenset[str], list[Promise]] = field(default_factory=dict)
    led_fits: dict[frozenset[str], FitResult] = field(default_factory=dict)
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
        for one in found:
            self._store(one)
        return found

    def _store(self, found: FitResult) -> None:
        """Take a fit for that of its set. One that comes near the data is screened anew."""
        key = frozenset(found.effects)
        if key in self.sets and self.is_far(self.sets[key]) and not self.is_far(found):
            self.promises.pop(key, None)
            self.led_fits.pop(key, None)
            self.expanded.discard(key)
        self.sets[key] = found

    def is_far(self, found: FitResult) -> bool:
        """Whether a fit leaves so much that slopes around it may mislead."""
        return found.mean_square > SUSPECT_MEAN_SQUARE

    def take_null(self, null: FitResult) -> None:
        """Take a better fit without effects in the place of the known one."""
        self.trace.append(search_step(self.null, "fitted anew", null))
        self.null = self.sets[frozenset()] = null
        self._forget_shared(frozenset())
        self.promises.pop(frozenset(), None)
        (led,) = self.runner.map(refit_along, [self.task(null)])
        known = self.led_fits.get(frozenset(), led)
        best = min(led, known, key=lambda one: one.cost)
        self.led_fits[frozenset()] = self.led_null = best

    def keep(self, found: FitResult) -> None:
        """Keep a fit if it is the best one of its set."""
        key = frozenset(found.effects)
        if key not in self.sets or found.cost < self.sets[key].cost:
            self._store(found)
            self.agreed.pop(key, None)
            self.led_fits.pop(key, None)
            self._forget_shared(key)

    def _forget_shared(self, smaller: frozenset[str]) -> None:
        """Forget whether samples share the gains over a set that is fitted better now."""
        self.shared = {key: one for key, one in self.shared.items() if not key >= smaller}

    @property
    def unrefuted(self) -> dict[frozenset[str], FitResult]:
        """The sets that neither the runs nor other forms of the laws refute."""
        return {key: one for key, one in self.sets.items() if not self.refuted(key)}

    def refuted(self, key: frozenset[str]) -> bool:
        """Whether a set is refuted, or a part of it, or its last effect gains no more.

        Further effects may only hide what refuted it. An effect that gains no more than one that
        stood for the error of the same laws may stand for it as well. So may one beside others that
        differs from run to run by its states, and none of whose sizes is certain.
        """
        found = self.sets.get(key)
        further = len(key) > 1 or self.beside_random
        if found and found.converged and found.insignificant and further:
            return True
        return any(
            other <= key or self._gains_no_more(key, other)
            for other, agreed in self.agreed.items()
            if not agreed
        ) or not self.shared.get(key, True)

    def _gains_no_more(self, key: frozenset[str], other: frozenset[str]) -> bool:
        """Whether a fit that has ended gains no more than one more effect of the same others."""
        if len(key) != len(other) or key not in self.sets or other not in self.sets:
            return False
        one, refuted = self.sets[key], self.sets[other]
        same = key > set(refuted.effects[:-1])
        return same and one.converged and one.cost >= refuted.cost

    def least_gain(self, others: int) -> float:
        """Least gain of log evidence of an effect beside so many others with exact laws."""
        return SETTINGS.needed_again if others or self.beside_random else SETTINGS.needed

    def needed(self, found: FitResult, others: int) -> float:
        """Least gain of log evidence that an effect needs beside so many others.

        found : fit of the set; a gain counts in the mean square that it leaves
        """
        least = self.least_gain(others) * max(1.0, found.mean_square)
        return max(least, self._gain_of_law_error(found, found.effects[:others]))

    def margin(self, found: FitResult, name: str) -> float:
        """Evidence up to which nothing tells another effect in the place of one of a set from it.

        Beside an approximate law the law's error may tell them apart the wrong way.
        """
        others = [other for other in found.effects if other != name]
        return max(CLASS_MARGIN, 2.0 * self._gain_of_law_error(found, others))

    def _gain_of_law_error(self, found: FitResult, others: Sequence[str]) -> float:
        """Gain of log evidence that the error of these others' laws may give to any effect.

        An approximate law is off by a share of what the set explains.
        """
        library = self.runner.model.candidates
        if all(library[name].exact_form for name in others):
            return 0.0
        return SETTINGS.law_error_along * 0.5 * (self.null.cost - found.cost)

    def value(self, found: FitResult) -> float:
        """Negative log evidence of a set, with the gain that each of its effects needs."""
        return 0.5 * found.cost + sum(self.needed(found, k) for k in range(len(found.effects)))

    def settled(self) -> FitResult:
        """Refit all sets near the best one until they converge; return the best.

        What the best one leaves beyond the noise a set may explain whose fit has not ended.
        """
        done: set[frozenset[str]] = set()
        while True:
            left = self.unrefuted
            best = min(left.values(), key=self.value)
            near = [
                one
                for key, one in left.items()
                if key not in done
                and len(key) == max(1, len(best.effects))
                and one.cost < best.cost + SETTINGS.near + (not one.converged) * excess(best)
            ]
            if not near and self._agrees(best):
                return best
            for one in self.fits(refit, near):
                done.add(frozenset(one.effects))
                self.trace.append(search_step(self.null, "converged", one))

    def is_shared(self, found: FitResult) -> bool:
        """Whether enough samples share the gain of each effect of a set.

        It is asked once, near the data: far off, most samples are off by more than their noise.
        """
        key = frozenset(found.effects)
        smaller = [self.sets[key - {name}] for name in key if key - {name} in self.sets]
        if not smaller or key in self.shared or self.is_far(found):
            return self.shared.get(key, True)
        pairs = [Pair(found, one, self.runner.runs) for one in smaller]
        gain = min(self.runner.map(shared_gain, pairs))
        self.shared[key] = gain >= self.least_gain(len(key) - 1)
        if not self.shared[key]:
            action = f"gains by few samples (as {gain:.1f} by many)"
            self.trace.append(search_step(self.null, action, found))
        return self.shared[key]

    def _agrees(self, found: FitResult) -> bool:
        """Whether each further effect of a set has one size, and gains beside other forms of laws.

        Beside a random effect all effects are further ones. It is asked once. Where one has not, an
        effect that gains more may take the place of the last one, or the last one that of the
        others.
        """
        key, base = frozenset(found.effects), frozenset(found.effects[:-1])
        further = found.effects if self.beside_random else found.effects[1:]
        if not further or key in self.agreed:
            return self.agreed.get(key, True)
        asked = [Reduction(found, self.runner.runs, name) for name in further]
        probability = min(self.runner.map(run_agreement, asked))
        if probability < SETTINGS.agreement:
            action = f"refuted by the runs (probability {probability:.1g})"
            self.trace.append(search_step(self.null, action, found))
            self.agreed[key] = False
        else:
            self.agreed[key] = self.gain_beside_forms(found, further)
        if not self.agreed[key]:
            self.expanded.discard(base)
            self._reduce(found)
        return self.agreed[key]

    def _reduce(self, found: FitResult) -> None:
        """Fit a refuted set without each of its effects, from where it leads.

        One effect leads the fit without any. A wrong first effect bends the size of the cause from
        run to run; a needless last one may lead the others out of a local minimum. It is the
        backward step of a floating search (P. Pudil and others, Pattern Recognition Letters 15
        (1994) 1119).
        """
        asked = [Reduction(found, self.runner.runs, name) for name in found.effects]
        if len(asked) == 1:
            (null,) = self.runner.map(without_effects, [(self.null, asked[0])])
            if null.cost < self.null.cost:
                self.take_null(null)
            return
        for one in self.runner.map(reduce, asked):
            self.keep(one)
            self.trace.append(search_step(self.null, "reduced", one))

    def gain_beside_forms(self, found: FitResult, effects: Sequence[str]) -> bool:
        """Whether each of these effects of a fit gains enough beside other forms of laws."""
        asked = [Reduction(found, self.runner.runs, name) for name in effects]
        gain = min(self.runner.map(gain_beside_forms, asked))
        if gain < SETTINGS.needed_again:
            action = f"refuted by other forms of a law (gain {gain:.1f})"
            self.trace.append(search_step(self.null, action, found))
        return gain >= SETTINGS.needed_again
