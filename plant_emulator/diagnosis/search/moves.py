"""The moves of a search: one more effect on top of a set.

Effects on top of a set that leaves more than noise are led along the measured outputs first, which
is short and takes contact in time, and the best of them are fitted freely.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting import evidence
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE, excess
from plant_emulator.diagnosis.fitting.fit_steps import refit_along
from plant_emulator.diagnosis.search.confirmation import (
    confirm,
    lead_trial,
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
        """The fit of a set along the measured outputs.

        It begins at the free fit or, without effects, at the best led fit that is known.
        """
        key = frozenset(base.effects)
        if key not in self.led_fits:
            start = base if key or self.led_null is None else self.led_null
            (self.led_fits[key],) = self.runner.map(refit_along, [self.task(start)])
        return self.led_fits[key]

    def leaves_most(self, found: FitResult, base: FitResult) -> bool:
        """Whether a fit leaves most of what another one leaves, also along the measured outputs.

        Far from the data a free fit with one of two causes may take contact at the wrong time.
        """
        if not evidence.leaves_most(found, base):
            return False
        return not self.is_far(found) or evidence.leaves_most(self.led(found), self.led(base))

    def fit_on_top(self, base: FitResult, new: Sequence[Promise], least: float) -> None:
        """Fit effects on top of a fit; least : gain that one must promise.

        Where the base leaves more than noise, a regression may mislead, and a free fit is long. The
        effects are led along the measured outputs first. The one that gains most there is fitted
        freely. Where it comes near the data and leaves little, those may only look the same that
        leave little too. Else it may be in a local minimum. Others are fitted then that gain half
        of what it gains along the measured outputs, or freely if that is less, and the one that
        each regression promises most of: what leads a simulation hides what is slow, and noise with
        a colour leads it. One further effect alone needs no choice.
        """
        trials = [trial_of(p, base, self.runner.runs) for p in new]
        if base.mean_square <= NOISE_MEAN_SQUARE or len(trials) < (2 if base.effects else 1):
            self.confirm([*trials[:1], *(_shorter(trial) for trial in trials[1:])])
            return
        own = self.led(base)
        pairs = list(self.runner.map(lead_trial, trials))
        self.trace += [search_step(own, "led", led, trial.promised) for trial, led in pairs]
        first, *rest = sorted(pairs, key=lambda pair: pair[1].cost)
        (best,) = self.confirm([first[0]])
        if not self.is_far(best) and evidence.leaves_little(best, excess(base)):
            rivals = [one for one, led in rest if evidence.leaves_little(led, excess(own))]
        else:
            promising = _most_promising(trials, least)
            most = max(0.0, min(_gain(own, first[1]), _gain(base, best)))
            needed = SETTINGS.rival_share * most
            rivals = [
                one for one, led in rest if one.effects in promising or _gain(own, led) >= needed
            ]
        self.confirm([_shorter(one) for one in rivals])

    def confirm(self, trials: Sequence[Trial]) -> list[FitResult]:
        """Fit these trials, and keep what they reach."""
        found = list(self.runner.map(confirm, trials))
        for trial, one in zip(trials, found, strict=True):
            self.keep(one)
            self.trace.append(search_step(self.null, "confirmed", one, trial.promised))
        return found


def _shorter(trial: Trial) -> Trial:
    """A trial with the iterations of a rival."""
    return replace(trial, iterations=SETTINGS.iterations)


def _most_promising(trials: Sequence[Trial], least: float) -> set[tuple[str, ...]]:
    """The sets whose last effect a regression promises most of; least : gain that counts."""
    scores = {score for one in trials for score in one.promised}
    best = {s: max(trials, key=lambda one: one.promised.get(s, 0.0)) for s in scores}
    return {one.effects for s, one in best.items() if one.promised.get(s, 0.0) > least}


def _gain(base: FitResult, found: FitResult) -> float:
    """Gain of a fit over another one."""
    return 0.5 * (base.cost - found.cost)
