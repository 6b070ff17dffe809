"""One round of a contest: every effect on top of a fit, the best of them taken further and further.

Most effects of most rounds lead nowhere, so that each step is made for fewer of them: all get a
first look, the best a few full steps, the best of these go to convergence and start again from some
way off.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import EVIDENCE_THRESHOLD, NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import WORTHWHILE_FALL
from plant_emulator.diagnosis.fitting.steps import contend, contend_far, follow, plod, refit, show
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.selection.contenders import (
    beside,
    best_few,
    better_of,
    closed,
    contender_of,
    cost_of,
    explained,
    least_cost,
    points_of,
    with_point,
)
from plant_emulator.diagnosis.selection.nominal import POLISHED, FromNominal, could_close
from plant_emulator.diagnosis.selection.restarts import Restarts
from plant_emulator.diagnosis.selection.rules import SECOND, noise_only
from plant_emulator.diagnosis.selection.subsystem import locate_gap
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Hypothesis
    from plant_emulator.diagnosis.fitting.signature import Signature
    from plant_emulator.diagnosis.machine import Model

RESTARTS = 3
# Best of a round's first looks that are fitted; the best of these are fitted to convergence.
CHOSEN = 8
# Share of the gap that an effect closes where no other is likely to close more, and where none is
# that a first look from a small size has missed.
MOST, MUCH = 0.9, 0.5
# Fall of the sum of squares that the signature promises where one more effect on top of noise is
# worth a look: there the linear picture holds.
GLIMPSE = 5.0
# Fall of the cost at first look that makes one more effect on top of noise worth a fit.
SIGHT = 20.0
# Share of the gap from which on a subsystem may be its place.
PLACED = 0.3
# Best of a round that start again from elsewhere.
SHAKEN = 3
# Mean square of a fit without effects, or with one, from which on it may lie so far from where the
# cause is that no signature there tells of it.
LOST = 4.0


class Rounds:
    """The rounds of one diagnosis on its pool.

    names : of the effects
    restarts : of single fits
    """

    def __init__(
        self,
        runner: TaskRunner,
        names: Sequence[str],
    ) -> None:
        self._runner, self._names, self._runs = runner, tuple(names), runner.runs
        self.restarts = Restarts(runner=runner)
        self.nominal = FromNominal(runner=runner, restarts=self.restarts)

    def from_clear(self, base: FitResult, null: FitResult) -> list[Hypothesis]:
        """All effects on top of the drift of some runs, the best of them fitted.

        null : the fit without effects to all runs
        """
        return self._taken_further(self._looked(base)[1], null)

    def contend(
        self,
        base: FitResult,
        *,
        thorough: bool,
        hasty: bool = False,
        known: FitResult | None = None,
    ) -> list[Hypothesis]:
        """All effects on top of a fit: a first look at each, the best of them fitted.

        thorough : where none leaves little, those that could close it get a second look from a
            larger size, or from the nominal parameters
        hasty : none is fitted to convergence where none closes much
        known : the fit with one more effect, where it has been made already
        """
        there = [] if known is None else [beside(known, base)]
        shown, contenders = self._looked(base, but=[c.effect for c in there])
        contenders += there
        if base.effects and noise_only(base):
            contenders = self._sighted(contenders, base)
            if base.cost - least_cost(contenders) < SECOND:
                return contenders
        contenders = self._taken_further(contenders, base, done=there, hasty=hasty)
        if base.mean_square <= NOISE_MEAN_SQUARE:
            if not base.effects and base.cost - least_cost(contenders) < EVIDENCE_THRESHOLD:
                signatures = [one for one in shown.values() if one is not None]
                contenders = self._patiently(contenders, signatures, base)
                contenders = self._fitted(contenders, base, 1, refit)
                nothing = base.cost - least_cost(contenders) < EVIDENCE_THRESHOLD
                if nothing and not noise_only(base):
                    contenders = self._from_afar(contenders, shown, base)
            return contenders
        if thorough and not explained(contenders) and not closed(contenders, base, MUCH):
            if base.effects or base.mean_square <= LOST:
                return self._from_afar(contenders, shown, base)
            contenders = self.nominal.surveyed(contenders, base)
        return contenders

    def deepened(self, contenders: Sequence[Hypothesis], base: FitResult) -> list[Hypothesis]:
        """The best of a round started again from elsewhere, where none leaves little and the fit
        that they are on top of may be astray.
        """
        if base.mean_square <= SUSPECT_MEAN_SQUARE or explained(contenders):
            return list(contenders)
        ended = [c for c in with_point(contenders) if c.fit and c.fit.converged]
        contenders = self._fitted(contenders, base, POLISHED, refit, ended)
        one = base.effects or closed(contenders, base, MOST)
        return self._moved(contenders, base, 1 if one else SHAKEN)

    def _patiently(
        self,
        contenders: Sequence[Hypothesis],
        signatures: Sequence[Signature],
        base: FitResult,
    ) -> list[Hypothesis]:
        """Effects whose signature promises nothing, but may be wrong, fitted all the same."""
        wrong = {one.effect: one for one in signatures if one.concentrated}
        tasks = [Task(base=base, runs=self._runs, signature=one) for one in wrong.values()]
        found = list(self._runner.map(plod, tasks))
        points = dict(zip(wrong, found, strict=True))
        return better_of(contenders, [replace(c, fit=points.get(c.effect)) for c in contenders])

    def _looked(
        self, base: FitResult, but: Sequence[str] = ()
    ) -> tuple[dict[str, Signature | None], list[Hypothesis]]:
        """The signatures of all other effects on top of a fit, and these after a first look."""
        names = [name for name in self._names if name not in {*base.effects, *but}]
        tasks = [Task(base=base, runs=self._runs, effect=name) for name in names]
        found = list(self._runner.map(show, tasks))
        shown = dict(zip(names, found, strict=True))
        promising = GLIMPSE if base.mean_square <= NOISE_MEAN_SQUARE else -inf
        tasks = [
            Task(base=base, runs=self._runs, effect=name, signature=one)
            for name, one in shown.items()
            if one is not None and one.gain > promising
        ]
        points = list(self._runner.map(contend, tasks))
        seen = dict(zip((task.effect for task in tasks), points, strict=True))
        return shown, [contender_of(name, one, seen.get(name)) for name, one in shown.items()]

    def _from_afar(
        self,
        contenders: Sequence[Hypothesis],
        shown: Mapping[str, Signature | None],
        base: FitResult,
    ) -> list[Hypothesis]:
        """Effects that could close the gap fitted from a larger size, where that is better."""
        large = [
            Task(base=base, runs=self._runs, effect=name, signature=one)
            for name, one in shown.items()
            if one is not None and could_close(one.total_norm, base)
        ]
        found = list(self._runner.map(contend_far, large))
        points = dict(zip((task.effect for task in large), found, strict=True))
        again = [
            replace(c, fit=p)
            for c in contenders
            if (p := points.get(c.effect)) is not None and p.cost < cost_of(c) - WORTHWHILE_FALL
        ]
        return better_of(contenders, self._taken_further(again, base))

    def _sighted(self, contenders: Sequence[Hypothesis], base: FitResult) -> list[Hypothesis]:
        """The best effect on top of noise fitted to convergence, where it is worth that."""
        found = list(contenders)
        for step in (follow, refit):
            if base.cost - least_cost(found) < SIGHT:
                break
            found = self._fitted(found, base, 1, step)
        return found

    def _taken_further(
        self,
        contenders: Sequence[Hypothesis],
        base: FitResult,
        *,
        done: Sequence[Hypothesis] = (),
        hasty: bool = False,
    ) -> list[Hypothesis]:
        """The best after a first look fitted, and the best of these to convergence.

        done : those that have been; hasty : see `contend`
        """
        found = self._fitted(contenders, base, CHOSEN, follow, done)
        if hasty and not (explained(found) or closed(found, base, MUCH)):
            return found
        return self._fitted(found, base, POLISHED, refit, done)

    def located(self, null: FitResult) -> frozenset[str]:
        """The subsystems that the gap of a fit without effects lies in, by themselves."""
        (found,) = self._runner.map(locate_gap, [Task(base=null, runs=self._runs)])
        shares = {} if found is None else found.shares
        return frozenset(name for name, share in shares.items() if share >= PLACED)

    def restarted(self, base: FitResult, contenders: Sequence[Hypothesis]) -> FitResult:
        """The best fit with the base's effects from the drift of the best contenders: a few steps
        from each, and on from where these lead lower.
        """
        most = 1 if base.effects and noise_only(base) else RESTARTS
        ranked = sorted(points_of(contenders), key=lambda p: p.cost)[:most]
        starts = [
            replace(p, effects=base.effects) for p in ranked if base.cost - p.cost > WORTHWHILE_FALL
        ]
        return self.restarts.lowest(base, starts)

    def in_place(self, contenders: Sequence[Hypothesis], best: FitResult) -> list[Hypothesis]:
        """A round's effects, the likeliest in the best one's place fitted from there.

        Where a round's fits stop in valleys, an effect's near twin may have been left behind.
        """
        names = [c.effect for c in with_point(contenders) if c.effect != best.effects[-1]]
        if best.mean_square <= SUSPECT_MEAN_SQUARE or not names:
            return list(contenders)
        found = self.restarts.swapped(best, names)
        again = [replace(c, fit=found) for c in contenders if c.effect == found.effects[-1]]
        return better_of(contenders, again)

    def _moved(
        self, contenders: Sequence[Hypothesis], base: FitResult, most: int
    ) -> list[Hypothesis]:
        """The best of a round started again from the nominal parameters and from some way off."""
        best = best_few(contenders, base, most)
        before = closed(contenders, base, MOST)
        contenders = better_of(contenders, self.nominal.fitted(base, best))
        if not base.effects and all(p.mean_square > LOST for p in points_of(contenders)):
            contenders = self.nominal.surveyed(contenders, base)
        if explained(contenders) or (closed(contenders, base, MOST) and not before):
            return list(contenders)
        best = best_few(contenders, base, most)
        new = {p.key: p for p in points_of(best) if not self.nominal.ended_at(p)}
        sifted = dict(zip(new, self.restarts.sifted([*new.values()]), strict=True))
        points = [sifted.get(p.key, p) for p in points_of(best)]
        first = [self.restarts.followed(point) for point in points[:1]]
        points = [*first, *self.restarts.shaken(points[1:])]
        again = [replace(c, fit=p) for c, p in zip(best, points, strict=True)]
        return better_of(contenders, again)

    def _fitted(
        self,
        contenders: Sequence[Hypothesis],
        base: FitResult,
        most: int,
        step: Callable[[Model, Task], FitResult],
        done: Sequence[Hypothesis] = (),
    ) -> list[Hypothesis]:
        """The best of a round taken a step further, but for those that are done."""
        best = [c for c in best_few(contenders, base, most) if c not in done]
        tasks = [Task(base=c.fit, runs=self._runs) for c in best if c.fit is not None]
        fitted = list(self._runner.map(step, tasks))
        further = {c.effect: replace(c, fit=p) for c, p in zip(best, fitted, strict=True)}
        return [further.get(c.effect, c) for c in contenders]
