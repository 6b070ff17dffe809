"""Which effects the logs ask for: forward and backward steps through the contest.

Forward: the effect whose joint fit lowers the cost most comes in, as long as its evidence counts
and the gap is not closed. Of a second, which stands on a fit that may have gone astray without it,
the likeliest others are fitted once more in its place. After every addition each earlier effect has
to stand the contest again, with all others in its place; and at the end each has to be missed when
it is taken out, and the other fitted alone from there and from the nominal parameters.

That a first effect leaves much may mean that there is a second, or that its fit is astray. The
second is looked for first, which is cheaper; where the two leave more than noise as well, the
effects of the subsystem that the gap lies in, as found without any hypothesis, start from the
nominal parameters, the best of every round from elsewhere, and all is gone through once more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import EVIDENCE_THRESHOLD, NOISE_MEAN_SQUARE, excess
from plant_emulator.diagnosis.fitting.explanation import Explanation
from plant_emulator.diagnosis.selection.backward import Backward
from plant_emulator.diagnosis.selection.contenders import (
    best_of,
    better_of,
    closed,
    costs_of,
    explained,
    least_cost,
)
from plant_emulator.diagnosis.selection.drifts import Drifts
from plant_emulator.diagnosis.selection.rounds import MOST, MUCH, Rounds
from plant_emulator.diagnosis.selection.rules import MOST_EFFECTS, counts, enough, noise_only

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Hypothesis

# Share of the gap that a better fit without effects closes when it has moved to another valley.
MOVED = 0.5
# Share of the gap that two may leave and be those: what other laws of them leave.
OTHER_LAW = 0.05


class Contest:
    """One diagnosis on its pool; see the module's text.

    by_chance : evidence of an effect of chance course, if the recipe's noise holds one
    null : the fit without effects, where it has been made already
    exact : names of effects whose law can have no other form
    subsystems : that the effects belong to, by effect
    """

    def __init__(
        self,
        runner: TaskRunner,
        names: Sequence[str],
        *,
        reaches_noise: bool = True,
        by_chance: float = 0.0,
        null: FitResult | None = None,
        exact: Collection[str] = (),
        subsystems: Mapping[str, str] | None = None,
    ) -> None:
        self._reaches_noise, self._by_chance, self._null = reaches_noise, by_chance, null
        self._exact, self._subsystems = frozenset(exact), subsystems or {}
        self._rounds = Rounds(runner, names)
        self._backward = Backward(rounds=self._rounds, counts=self._counts)
        self._drifts = Drifts(runner=runner)
        self._deep, self._from_clear_only = not reaches_noise, False
        # Rounds on top of effects, by the fit: none is made twice.
        self._on_top: dict[object, list[Hypothesis]] = {}

    def explain(self) -> Explanation:
        """Go through the contest."""
        null, contenders = self._first(self._null or self._drifts.of_all())
        found = self._stepped(null, contenders)
        if not self._deep and not _settled(found):
            self._deep = True
            found = self._stepped(*self._deepened(null, contenders))
        return found

    def _deepened(
        self, null: FitResult, contenders: Sequence[Hypothesis]
    ) -> tuple[FitResult, list[Hypothesis]]:
        """A first round in earnest: the effects of the place that the gap lies in from the nominal
        parameters; and also from the fit to all runs, where that has not been done.
        """
        there = self._rounds.located(null)
        found = [c for c in contenders if self._subsystems.get(c.effect) in there]
        contenders = better_of(contenders, self._rounds.nominal.surveyed(found, null))
        if self._from_clear_only and not closed(contenders, null, MOST):
            null, found = self._from_all(null)
            return self._confirmed(null, better_of(found, contenders))
        return self._confirmed(null, self._rounds.deepened(contenders, null))

    def _stepped(self, null: FitResult, contenders: Sequence[Hypothesis]) -> Explanation:
        """Forward and backward steps from the fit without effects and the first round on it."""
        null = self._rounds.restarts.settled(null)
        final = null
        rivals: dict[str, dict[str, float]] = {}
        tried: set[frozenset[str]] = set()
        without: dict[str, float] = {}
        while len(final.effects) < MOST_EFFECTS and not enough(final, null, self._reaches_noise):
            found = list(contenders)
            if final.effects:
                final, found = self._further(final)
                if not (self._deep or _settles(found, final)):
                    break
            best = best_of(found)
            if best is None or not self._counts(best, final, null):
                break
            if final.effects:
                found = self._rounds.in_place(found, best)
                best = best_of(found) or best
            final, rivals = self._backward.stand(best, found)
            final, without = self._backward.missed(final, null)
            if len(final.effects) == 1:
                rivals = {final.effects[0]: costs_of(contenders)}
            if frozenset(final.effects) in tried:
                break  # each makes the other needless, in turn
            tried.add(frozenset(final.effects))
        final = self._rounds.restarts.settled(final)
        return Explanation(
            null=null,
            final=final,
            hypotheses=tuple(contenders),
            alternatives=rivals,
            unconverged=_unconverged(null, final),
            reduced_costs=_least(without, costs_of(contenders)),
        )

    def _first(self, null: FitResult) -> tuple[FitResult, list[Hypothesis]]:
        """All effects on the fit without any, and that fit, started again from the best of them."""
        null, contenders, self._from_clear_only = self._from_clear(null)
        if not self._from_clear_only:
            null, found = self._from_all(null)
            contenders = better_of(found, contenders)
        return self._confirmed(null, contenders)

    def _confirmed(
        self, null: FitResult, contenders: Sequence[Hypothesis]
    ) -> tuple[FitResult, list[Hypothesis]]:
        """A first round, and the fit without effects, started again from the best of it.

        All are tried again when the fit without effects has moved to another valley and they leave
        much, or are no better than it: in a cost of many valleys a signature is but a hint.
        """
        better = self._rounds.restarted(null, contenders)
        moved = null.cost - better.cost > max(EVIDENCE_THRESHOLD, MOVED * excess(null))
        if moved or (better.mean_square <= NOISE_MEAN_SQUARE and not noise_only(better)):
            better = self._rounds.restarts.followed(better)
            moved = null.cost - better.cost > max(EVIDENCE_THRESHOLD, MOVED * excess(null))
        stale = moved and better.cost - least_cost(contenders) < EVIDENCE_THRESHOLD
        if not stale and (explained(contenders) or closed(contenders, better, MOST)):
            return better, list(contenders)
        if moved:
            again = self._searched(better)
            contenders = better_of(contenders, again)
            better = self._rounds.restarted(better, contenders)
        return better, list(contenders)

    def _from_clear(self, null: FitResult) -> tuple[FitResult, list[Hypothesis], bool]:
        """The fit without effects, and all effects, from the drift of the runs that need none; and
        whether one explains half of what the others show. No effects where there are no such runs.
        """
        if null.mean_square <= NOISE_MEAN_SQUARE:
            return null, [], False
        starts, clear = self._drifts.of_some(null)
        null = self._rounds.restarts.lowest(null, starts)
        if null.mean_square <= NOISE_MEAN_SQUARE or not clear:
            return null, [], False
        (base,) = starts
        contenders = self._rounds.from_clear(base, null)
        half = explained(contenders) or closed(contenders, base, MUCH)
        return null, contenders, half and null.cost - least_cost(contenders) > EVIDENCE_THRESHOLD

    def _from_all(self, null: FitResult) -> tuple[FitResult, list[Hypothesis]]:
        """The first round on the fit without effects to all runs; that fit starts again where it
        leaves much.
        """
        if null.mean_square > NOISE_MEAN_SQUARE:
            (null,) = self._rounds.restarts.shaken([null])
        return null, self._searched(null)

    def _searched(self, null: FitResult) -> list[Hypothesis]:
        """A first round; the best of it started again where none closes much, or in earnest."""
        found = self._rounds.contend(null, thorough=True)
        shallow = closed(found, null, MUCH) and not self._deep
        return found if shallow else self._rounds.deepened(found, null)

    def _further(self, base: FitResult) -> tuple[FitResult, list[Hypothesis]]:
        """A fit with effects started again from the best others on top of it, and all of these."""
        if base.key not in self._on_top:
            hasty = not self._deep
            found = self._rounds.contend(base, thorough=False, hasty=hasty)
            self._on_top[base.key] = found
        found = self._on_top[base.key]
        if self._deep:
            found = self._rounds.deepened(found, base)
        elif not _settles(found, base):
            return base, found
        return self._rounds.restarted(base, found), found

    def _counts(self, best: FitResult, base: FitResult, null: FitResult) -> bool:
        """Whether one more effect earns its place."""
        return counts(
            best,
            base,
            null,
            self._reaches_noise,
            by_chance=self._by_chance,
            exact=self._exact.issuperset(base.effects),
        )


def _settles(found: Sequence[Hypothesis], base: FitResult) -> bool:
    """Whether a second effect explains so much that nothing is likely to be astray."""
    return explained(found) or closed(found, base, MOST)


def _settled(found: Explanation) -> bool:
    """Whether a contest leaves so little that its fits are not astray."""
    if found.final.mean_square <= NOISE_MEAN_SQUARE:
        return True
    both = len(found.final.effects) == MOST_EFFECTS
    return both and excess(found.final) <= OTHER_LAW * excess(found.null)


def _least(without: Mapping[str, float], alone: Mapping[str, float]) -> dict[str, float]:
    """Least cost without each of two effects: refitted from both, or of the other one alone."""
    names = set(without)
    return {
        name: min([cost, *(alone[e] for e in names - {name} if e in alone)])
        for name, cost in without.items()
    }


def _unconverged(null: FitResult, final: FitResult) -> str:
    """Why a contest cannot be trusted; empty where it can."""
    if not final.converged:
        return "the last fit did not converge"
    if not null.converged:
        return "the fit without effects did not converge"
    return ""
