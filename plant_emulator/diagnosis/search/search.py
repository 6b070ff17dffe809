"""Searches the set of effects of largest log evidence: add effects, and drop those without need.

The best set (`fitted_sets`) is expanded by the effects of largest gain until it leaves only noise
or what is random, none gains enough, or the cause is foreign. Then needless effects are dropped.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.execution.pool import build_model
from plant_emulator.diagnosis.fitting.evidence import (
    EVIDENCE_THRESHOLD,
    NOISE_MEAN_SQUARE,
    adequate,
    evidence_of,
    excess,
    leaves_little,
    leaves_most,
    leaves_random,
)
from plant_emulator.diagnosis.fitting.explanation import Explanation
from plant_emulator.diagnosis.fitting.fit_steps import refit
from plant_emulator.diagnosis.screening.promise import to_try
from plant_emulator.diagnosis.screening.screening import SIMULATION, promises
from plant_emulator.diagnosis.screening.visibility import visibilities
from plant_emulator.diagnosis.search import summary
from plant_emulator.diagnosis.search.confirmation import (
    Reduction,
    reduce,
    without_effects,
)
from plant_emulator.diagnosis.search.law_forms import errors_beside_forms
from plant_emulator.diagnosis.search.logged_noise import WhitenedRecipe, estimate_noise
from plant_emulator.diagnosis.search.moves import Moves
from plant_emulator.diagnosis.search.summary import not_told_apart, search_step
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.screening.promise import Promise
    from plant_emulator.estimation.noise.logged_noise import LoggedNoise


@dataclass(kw_only=True)
class Search(Moves):
    """The search of one diagnosis; see the module's text.

    declared : in the noise that the sensors declare; `runner` leaves the outliers out too
    noise : of the logs; noise_at : the last fit that noise was estimated around
    reduced_costs : of the best set without each of its effects
    """

    declared: TaskRunner
    noise: LoggedNoise | None = None
    noise_at: tuple[object, ...] = ()
    reduced_costs: dict[str, float] = field(default_factory=dict)

    def explain(self) -> Explanation:
        """Go through the queue in the logs' own noise.

        The noise is estimated around the fit without effects where that is near the noise and no
        other set is known, or else around the best set of one effect, and then around the best set
        if it explains a third of the gap. Where that shows another noise, the queue starts again.
        Beside known sets the single effects are tried as well.
        """
        known = any(self.sets) and not self.beside_random
        self.sets[frozenset()] = self.null
        if known:
            self._expand(self.null)
        self._estimate_noise(self._queue(1) if known or self.is_far(self.null) else self.null)
        best = self._queue(SETTINGS.most_effects)
        if best.effects and not leaves_most(best, self.null) and self._estimate_noise(best):
            best = self._queue(SETTINGS.most_effects)
        final = self._without_needless(best)
        if not final.converged:
            (final,) = self.fits(refit, [final])
            self.null = self.sets[frozenset()]
        return self._explanation(final)

    def _estimate_noise(self, where: FitResult) -> bool:
        """Take the noise around a fit for the logs' own; give whether it is another one now.

        A set of effects that is far from the data and leaves more than noise in this noise too
        lacks a cause, part of which passed for noise. The weights of a random effect fit the noise
        as it was declared.
        """
        if self.noise_at == where.key or self.beside_random:
            return False
        self.noise_at = where.key
        (noise,) = self.declared.map(estimate_noise, [self.task(where)])
        known = self.noise
        if (known is None and noise.plain) or (known is not None and noise.resembles(known)):
            return False
        recipe = WhitenedRecipe(self.declared.recipe, noise)
        runner = replace(self.declared, recipe=recipe, model=build_model(recipe))
        (there,) = runner.map(refit, [self.task(where)])
        lacks = self.is_far(where) and there.mean_square > NOISE_MEAN_SQUARE
        if where.effects and lacks:
            return False
        self.noise, self.runner = noise, runner
        kept = [one for one in not_told_apart(self.unrefuted) if one.key != where.key]
        self.promises.clear()
        self.led_fits.clear()
        self.expanded.clear()
        self.agreed.clear()
        self.shared.clear()
        self.sets = {frozenset(there.effects): there}
        self.fits(refit, kept)
        self.null = self.sets[frozenset()]
        self.trace.append(search_step(self.null, "noise estimated", there))
        return True

    def _queue(self, most_effects: int) -> FitResult:
        """The best set of at most so many effects."""
        best = self.settled()
        while len(best.effects) < most_effects:
            key = frozenset(best.effects)
            if key in self.expanded or self._is_last(best):
                break
            self.expanded.add(key)
            self._expand(best)
            best = self.settled()
        return best

    def _is_last(self, found: FitResult) -> bool:
        """Whether no effect is worth adding: the cause is foreign, or what is left is random.

        An effect that leaves most of what the others leave is no base for another one. A first
        effect near the data always is. The noise of a random effect is that of few courses of its
        law. Beside it and another one, a gain within the noise may be that of the errors of both
        laws.
        """
        if not found.effects:
            return False
        if self.beside_random and found.mean_square <= NOISE_MEAN_SQUARE:
            self._screen(found)  # for the odds against one more effect
            return True
        foreign = self.leaves_most(found, self._smaller(found))
        if len(found.effects) == 1:
            foreign = foreign and self.is_far(found)
        if found.mean_square > NOISE_MEAN_SQUARE:
            return foreign or (leaves_random(found) and not self.beside_random)
        return all(p.gain <= self._promising(found) for p in self._screen(found))

    def _smaller(self, found: FitResult) -> FitResult:
        """The best fit of a set without one of its effects; without effects where none is known."""
        key = frozenset(found.effects)
        known = [self.sets[key - {name}] for name in key if key - {name} in self.sets]
        return min(known, key=lambda one: one.cost, default=self.null)

    def _screen(self, found: FitResult) -> list[Promise]:
        key = frozenset(found.effects)
        if key not in self.promises:
            led = self.led(found) if self.is_far(found) else None
            self.promises[key] = promises(self.runner, found, led)
        return self.promises[key]

    def _promising(self, found: FitResult) -> float:
        """Predicted gain from which on one more effect is fitted on top of a fit."""
        return SETTINGS.rival_share * self.least_gain(len(found.effects))

    def _expand(self, base: FitResult) -> None:
        """Fit the effects of largest gain on top of a set.

        Regressions predict it, and fits along the measured outputs choose among their leaders.
        """
        least = self._promising(base)
        key = frozenset(base.effects)
        found = [p for p in self._screen(base) if not self.refuted(key | {p.effect})]
        tried = [p.effect for p in found if key and key | {p.effect} in self.sets]
        new = to_try(found, base, least, tried)
        self.fit_on_top(base, new, least)
        if base.effects:
            return
        single = [one for names, one in self.unrefuted.items() if len(names) == 1]
        best = min(single, key=lambda one: one.cost, default=base)
        if best is not base and not leaves_most(best, self.null) and self._renew_null(best):
            self._expand(self.null)

    def _renew_null(self, found: FitResult) -> bool:
        """Fit without effects anew from one with some; give whether the two are rivals now."""
        asked = Reduction(found, self.runner.runs, found.effects[-1])
        (null,) = self.runner.map(without_effects, [(self.null, asked)])
        least = max(EVIDENCE_THRESHOLD, SETTINGS.rival_share * (self.null.cost - found.cost))
        if self.null.cost - null.cost < least:
            return False
        self.take_null(null)
        return True

    def _without_needless(self, best: FitResult) -> FitResult:
        """Drop the effect that closes least until each one closes enough, and by enough samples.

        Each set is compared with smaller ones that begin where it leads: it may have left a local
        minimum of theirs. Where a set leaves something correlated, an effect that follows a little
        of it is needless: its evidence among what is left is that of chance. An effect is the cause
        of what the others leave only if it leaves little of that, or, where the set leaves no more
        of the gap than approximate laws do, less than half: any effect follows a part of their
        errors. The first effect must gain beside other forms of the laws too, if it is the one that
        closes least. No part of a set is the cause where the set is none.
        """
        self.reduced_costs = {}
        if not best.effects or not adequate(best, self.null):
            return best
        asked = [Reduction(best, self.runner.runs, name) for name in best.effects]
        if len(asked) == 1:
            return self._beside_renewed_null(best, asked[0])
        for one, found in zip(asked, self.runner.map(reduce, asked), strict=True):
            self.keep(found)
            self.reduced_costs[one.effect] = self.sets[frozenset(found.effects)].cost
        found = self.settled()
        if found.effects != best.effects:
            return self._without_needless(found)
        cheapest = min(self.reduced_costs, key=self.reduced_costs.__getitem__)
        (least,) = self.fits(refit, [self.sets[frozenset(best.effects) - {cheapest}]])
        self.reduced_costs[cheapest] = least.cost
        fall = least.cost - found.cost
        library = self.runner.model.candidates
        approximate = any(not library[e].exact_form for e in least.effects)
        half = 2.0 * excess(found) <= excess(least)
        hundredth = excess(found) <= SETTINGS.law_error**2 * excess(self.null)
        closes = (
            found.mean_square <= NOISE_MEAN_SQUARE
            or leaves_little(found, excess(found) + fall)
            or (approximate and hundredth and half)
        )
        needed = closes and evidence_of(fall, found, self.null) >= EVIDENCE_THRESHOLD
        # The other effects have been asked as further ones.
        if needed and (cheapest != found.effects[0] or self.gain_beside_forms(found, [cheapest])):
            return self._if_shared(found)
        self.sets = {k: one for k, one in self.sets.items() if len(k) < len(best.effects)}
        return self._without_needless(self.settled())

    def _beside_renewed_null(self, best: FitResult, asked: Reduction) -> FitResult:
        """The one effect; what the queue finds where a better fit without it takes its gain."""
        (null,) = self.runner.map(without_effects, [(self.null, asked)])
        if null.cost < self.null.cost:
            self.take_null(null)
        if min(self.unrefuted.values(), key=self.value).effects == best.effects:
            return self._if_shared(best)
        self.expanded.discard(frozenset())
        return self._without_needless(self._queue(SETTINGS.most_effects))

    def _if_shared(self, best: FitResult) -> FitResult:
        """The set where enough samples share its gains; else what the queue finds without it."""
        if self.is_shared(best):
            return best
        self.expanded.discard(frozenset(best.effects[:-1]))
        return self._without_needless(self._queue(SETTINGS.most_effects))

    def _explanation(self, final: FitResult) -> Explanation:
        asked = self.runner.map(errors_beside_forms, [self.task(final)])  # the longer one first
        (shown,) = self.runner.map(visibilities, [self.task(self.null)])
        (errors,) = asked
        final = replace(final, standard_errors=errors)
        key, sets = frozenset(final.effects), self.unrefuted
        larger = {
            p.effect: self.needed(final, len(key)) - p.gains.get(SIMULATION, p.gain)
            for p in self.promises.get(key, [])
            if not self.refuted(key | {p.effect})
        }
        margins = {name: self.margin(final, name) for name in final.effects}
        values = {names: self.value(one) for names, one in sets.items()}
        return Explanation(
            null=self.null,
            final=final,
            hypotheses=summary.hypotheses(sets, shown),
            alternatives={name: summary.alternatives(sets, final, name) for name in final.effects},
            unconverged=summary.unconverged(final),
            log_odds=summary.log_odds(sets, values, final, larger, margins),
            margins=margins,
            reduced_costs=self.reduced_costs,
            trace=tuple(self.trace),
            noise=self.noise.channels if self.noise else {},
        )
