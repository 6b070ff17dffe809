"""The moves of a search: one more effect on top of a set, and a fit led once more.

Effects on top of a set that leaves more than noise are led along the measured outputs first, which
is short and takes contact in time, and the best of them are fitted freely.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting import evidence
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE, excess
from plant_emulator.diagnosis.fitting.fit_steps import refit_along, refit_led, start_along
from plant_emulator.diagnosis.screening.promise import Start
from plant_emulator.diagnosis.screening.screening import SIMULATION
from plant_emulator.diagnosis.search.confirmation import (
    confirm,
    lead_others,
    lead_start,
    trial_of,
)
from plant_emulator.diagnosis.search.fitted_sets import FittedSets
from plant_emulator.diagnosis.search.summary import search_step
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.screening.promise import Promise
    from plant_emulator.diagnosis.search.confirmation import Trial


@dataclass(kw_only=True)
class Moves(FittedSets):
    """The fitted sets of effects, and what leads from one set to another."""

    def led(self, base: FitResult) -> FitResult:
        """The fit of a set along the measured outputs, begun at its free fit.

        Far from the data the free fit without effects has bent the parameters, some up to their
        bounds, and the model's own start may lead to less. Either may end in a local minimum.
        """
        key = frozenset(base.effects)
        if key not in self.led_fits:
            leads = [self.runner.map(refit_along, [self.task(base)])]
            if not key and self.is_far(base):
                leads.append(self.runner.map(start_along, [self.runner.runs]))
            found = [one for some in leads for one in some]
            self.led_fits[key] = min(found, key=lambda one: one.cost)
        return self.led_fits[key]

    def leaves_most(self, found: FitResult, base: FitResult) -> bool:
        """Whether a fit leaves most of what another one leaves, also along the measured outputs.

        Far from the data a free fit with one of two causes may take contact at the wrong time.
        """
        if not evidence.leaves_most(found, base):
            return False
        return not self.is_far(found) or evidence.leaves_most(self.led(found), self.led(base))

    def fit_on_top(self, base: FitResult, new: Sequence[Promise], least: float) -> list[FitResult]:
        """Fit effects on top of a fit; least : gain that one must promise.

        Where the base leaves more than noise, a regression may mislead, and a free fit is long. The
        effects are led along the measured outputs first. The one that gains most there is fitted
        freely. Where it comes near the data and leaves little, those may only look the same that
        leave little too; they may begin where it ends. Else it may be in a local minimum, and
        others are fitted (`_others`). Of several further effects near the data none is fitted that
        cannot explain half of what the others leave.
        """
        trials = [trial_of(p, base, self.runner.runs, SETTINGS.leader_iterations) for p in new]
        if base.mean_square <= NOISE_MEAN_SQUARE or len(trials) < (2 if base.effects else 1):
            found = self.confirm([*trials[:1], *(_shorter(trial) for trial in trials[1:])])
            return [*(self.led_again(one) for one in found[:1]), *found[1:]]
        own = self.led(base)
        pairs = self._led_starts(own, trials)
        self.trace += [search_step(own, "led", led, trial.promised) for trial, led in pairs]
        if base.effects and not self.is_far(base):
            pairs = [pair for pair in pairs if self._may_explain(base, *pair)]
        if not pairs:
            return []
        first, *rest = sorted(pairs, key=lambda pair: pair[1].cost)
        (confirmed,) = self.confirm([first[0]])
        best = self.led_again(confirmed)
        if not self.is_far(best) and evidence.leaves_little(best, excess(base)):
            alike = [pair for pair in rest if evidence.leaves_little(pair[1], excess(own))]
            return [best, *self.confirm([self._beginning_at(best, *pair) for pair in alike])]
        return [best, *self._others(base, best, rest, _gain(own, [first[1]]), least)]

    def _others(
        self,
        base: FitResult,
        leader: FitResult,
        rest: Sequence[tuple[Trial, FitResult]],
        most_led: float,
        least: float,
    ) -> list[FitResult]:
        """Fit others on top of a fit whose leader leaves much, or is far from the data.

        First ones are fitted as long as a regression promises more of one than any has reached. Of
        the rest those are fitted for less long that gain half of the most along the measured
        outputs, or of what was reached, or whose free simulation promises half, near the data: slow
        effects.

        most_led : gain of the leader along the measured outputs
        least : gain that an effect must promise
        """
        found, left = [leader], list(rest)
        for pair in sorted([] if base.effects else rest, key=lambda pair: -_promised(pair[0])):
            if _promised(pair[0]) > _gain(base, found):
                found += self.confirm([pair[0]])
                left = [one for one in left if one is not pair]
        reached, own = _gain(base, found), self.led(base)
        least_led = SETTINGS.rival_share * max(0.0, min(most_led, reached))
        least = max(least, SETTINGS.rival_share * reached)
        rivals = [
            _shorter(trial)
            for trial, led in left
            if _gain(own, [led]) >= least_led or trial.promised.get(SIMULATION, 0.0) > least
        ]
        return [*found[1:], *self.confirm(rivals)]

    def _led_starts(self, own: FitResult, trials: Sequence[Trial]) -> list[tuple[Trial, FitResult]]:
        """Each trial with its best start led along the measured outputs, and that fit.

        A first effect that keeps less than a regression promises is led from other starts too
        (`lead_others`).

        own : the base of the trials, led as well
        """
        pairs = list(self.runner.map(lead_start, trials))
        if own.effects:
            return pairs
        short = [k for k, (trial, led) in enumerate(pairs) if _gain(own, [led]) < _promised(trial)]
        further = self.runner.map(lead_others, [(pairs[k], own) for k in short])
        for k, pair in zip(short, further, strict=True):
            pairs[k] = pair
        return pairs

    def _beginning_at(self, other: FitResult, trial: Trial, led: FitResult) -> Trial:
        """A rival's trial that may also begin where a fit with another last effect has come to.

        The rival's own lead may end in a local minimum that the other one does not have.
        """
        neutral = self.runner.model.candidates[other.effects[-1]].neutral
        there = Start(
            values={**led.values, **other.values, **neutral},
            states=tuple({**a, **b} for a, b in zip(led.states, other.states, strict=True)),
        )
        return _shorter(replace(trial, starts=(there, *trial.starts)))

    def _may_explain(self, base: FitResult, trial: Trial, led: FitResult) -> bool:
        """Whether a further effect may explain half of what the base leaves, led or freely."""
        half = 0.5 * evidence.LARGER_SHARE * excess(base)
        slow = trial.promised.get(SIMULATION, 0.0) >= half
        return slow or not evidence.leaves_most(led, self.led(base))

    def confirm(self, trials: Sequence[Trial]) -> list[FitResult]:
        """Fit these trials, and keep what they reach."""
        found = list(self.runner.map(confirm, trials))
        for trial, one in zip(trials, found, strict=True):
            self.keep(one)
            self.trace.append(search_step(self.null, "confirmed", one, trial.promised))
        return found

    def led_again(self, found: FitResult) -> FitResult:
        """The fit, led along the measured outputs once more where it may be in a local minimum.

        It explains half of the gap there, and leaves more than noise does. The first time, the
        other parameters were those without the effect.
        """
        if found.mean_square <= NOISE_MEAN_SQUARE or evidence.leaves_most(found, self.null):
            return found
        (again,) = self.runner.map(refit_led, [self.task(found)])
        self.keep(again)
        self.trace.append(search_step(self.null, "led again", again))
        return min(found, again, key=lambda one: one.cost)


def _shorter(trial: Trial) -> Trial:
    """A trial with the iterations of a rival."""
    return replace(trial, iterations=SETTINGS.iterations)


def _promised(trial: Trial) -> float:
    """Largest gain that a regression promises."""
    return max(trial.promised.values(), default=0.0)


def _gain(base: FitResult, found: Sequence[FitResult]) -> float:
    """Largest gain of fits over another one."""
    return max((0.5 * (base.cost - one.cost) for one in found), default=0.0)
