"""Which effects the logs ask for: forward and backward steps through the contest.

Forward: the effect whose joint fit lowers the cost most comes in, as long as its evidence counts
and the gap is not closed. After every addition each earlier effect has to stand the contest again,
with all others in its place; and at the end each has to be missed when it is taken out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from plant_emulator.diagnosis.contest import ASTRAY, WORTH
from plant_emulator.diagnosis.explain import (
    MARGIN,
    THRESHOLD,
    Contender,
    Explanation,
    excess,
)
from plant_emulator.diagnosis.pool import model_of
from plant_emulator.diagnosis.rules import counts, enough
from plant_emulator.diagnosis.steps import Task, contend, once_more, refit, show, start

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from plant_emulator.diagnosis.contest import Point
    from plant_emulator.diagnosis.model import Model
    from plant_emulator.diagnosis.pool import Pool, Recipe
    from plant_emulator.diagnosis.signature import Signature

    Progress = Callable[[str, float], None]
    Shown = Mapping[str, Signature | None]

Found = TypeVar("Found")

# Mean square up to which a model leaves nothing but noise.
NOISE_LEFT = 1.05
# Share of the gap that a better fit without effects closes when it has moved to another valley.
MOVED = 0.1
# More effects than that at once explain anything.
MOST_EFFECTS = 2
RESTARTS = 3
# Times that a fit that ran out of steps is taken up again.
PATIENCE = 3
# Effects that are fitted before the others, and on top of another effect at all.
PROMISING, FURTHER_PROMISING = 12, 10
# Best of a round that are fitted to convergence.
POLISHED = 5
# Fall of the sum of squares that a signature has to promise to be fitted.
HOPELESS = 4.0


class Contest:
    """One diagnosis on its pool; see the module's text."""

    def __init__(
        self,
        pool: Pool,
        recipe: Recipe,
        names: Sequence[str],
        runs: Sequence[int],
        progress: Progress | None = None,
        *,
        reaches_noise: bool = True,
    ) -> None:
        self._reaches_noise = reaches_noise
        self._pool, self._recipe, self._names = pool, recipe, tuple(names)
        self._runs, self._progress = tuple(runs), progress
        self._model: Model = model_of(recipe)

    def explain(self) -> Explanation:
        """Go through the contest."""
        (null,) = self._pool.map(start, self._recipe, [self._runs])
        null, contenders = self._first(null)
        final = null
        rivals: dict[str, dict[str, float]] = {}
        while len(final.effects) < MOST_EFFECTS and not enough(final, null, self._reaches_noise):
            found = contenders
            if final.effects:
                final, found = self._further(final, "further effects")
            best = _best(found)
            if best is None or not counts(best, final, null, self._reaches_noise):
                break
            final = best
            final, rivals = self._stand(final, found)
        final = self._settled(final)
        return Explanation(
            null=null,
            final=final,
            contenders=tuple(contenders),
            rivals=rivals,
            unconverged="" if final.converged else "the last fit did not converge",
        )

    def _settled(self, final: Point) -> Point:
        """The fit taken up again where it ran out of steps."""
        for _ in range(PATIENCE):
            if final.converged:
                break
            (final,) = self._pool.map(refit, self._recipe, [Task(base=final, runs=self._runs)])
        return final

    def _first(self, null: Point) -> tuple[Point, list[Contender]]:
        """All effects on the fit without any, and that fit, started again from the best of them.

        The most promising come first. Unless one of them leaves nothing but noise, the rest follow,
        and those that promise nothing too where there is a gap: in a cost of many valleys a
        signature is but a hint. All are tried again where the fit without effects has moved to
        another valley, and start once more from the nominal parameters where it leaves much.
        """
        stage = "contest"
        shown, promising = self._show(null, stage)
        contenders = self._contend(null, shown, promising[:PROMISING], stage)
        if not _explained(contenders):
            rest = promising[PROMISING:]
            if null.chi_squared > NOISE_LEFT:
                rest += [name for name, one in shown.items() if one and name not in promising]
            contenders = _better(contenders, self._contend(null, shown, rest, stage))
        better = self._restarted(null, contenders)
        if _explained(contenders):
            return better, contenders
        if null.cost - better.cost > max(THRESHOLD, MOVED * excess(null)):
            shown, promising = self._show(better, stage)
            contenders = _better(contenders, self._contend(better, shown, promising, stage))
        if better.chi_squared > ASTRAY and not _explained(contenders):
            contenders = _better(contenders, self._from_nominal(better, contenders, stage))
            better = self._restarted(better, contenders)
        return better, contenders

    def _further(self, base: Point, stage: str) -> tuple[Point, list[Contender]]:
        """The most promising effects on top of others, and that fit started again from theirs."""
        shown, promising = self._show(base, stage)
        contenders = self._contend(base, shown, promising[:FURTHER_PROMISING], stage)
        return self._restarted(base, contenders), contenders

    def _show(self, base: Point, stage: str) -> tuple[Shown, list[str]]:
        """Signatures of all effects, and those worth a fit, the most promising first.

        One with states of its own is always worth it, and comes first: its signature is that of one
        start state, and says little of others.
        """
        names = [name for name in self._names if name not in base.effects]
        tasks = [Task(base=base, runs=self._runs, effect=name) for name in names]
        found = self._told(stage, tasks, self._pool.map(show, self._recipe, tasks))
        shown = dict(zip(names, found, strict=True))
        promise = {name: self._promise(one) for name, one in shown.items() if one is not None}
        order = sorted(promise, key=promise.__getitem__, reverse=True)
        return shown, [name for name in order if promise[name] >= HOPELESS]

    def _promise(self, shown: Signature) -> float:
        if self._model.candidates[shown.effect].states:
            return np.inf
        return max(shown.gain, shown.tangent_gain)

    def _contend(
        self, base: Point, shown: Shown, chosen: Sequence[str], stage: str
    ) -> list[Contender]:
        """All that show, the chosen ones with their joint fit."""
        tasks = [
            Task(base=base, runs=self._runs, effect=name, signature=shown[name]) for name in chosen
        ]
        found = self._told(stage, tasks, self._pool.map(contend, self._recipe, tasks))
        points = dict(zip(chosen, found, strict=True))
        return self._polished(
            [_contender(name, one, points.get(name)) for name, one in shown.items()]
        )

    def _from_nominal(
        self, base: Point, contenders: Sequence[Contender], stage: str
    ) -> list[Contender]:
        """All effects that show at all, fitted from the nominal parameters."""
        moving = [c for c in contenders if c.norm > 0.0]
        tasks = [Task(base=base, runs=self._runs, effect=c.effect) for c in moving]
        points = self._told(stage, tasks, self._pool.map(once_more, self._recipe, tasks))
        return self._polished([replace(c, point=p) for c, p in zip(moving, points, strict=True)])

    def _polished(self, contenders: Sequence[Contender]) -> list[Contender]:
        """The best of a round fitted to convergence."""
        order = sorted(contenders, key=lambda c: c.point.cost if c.point else float("inf"))
        best = [c for c in order[:POLISHED] if c.point is not None]
        tasks = [Task(base=c.point, runs=self._runs) for c in best if c.point is not None]
        fitted = self._pool.map(refit, self._recipe, tasks)
        done = {c.effect: replace(c, point=p) for c, p in zip(best, fitted, strict=True)}
        return [done.get(c.effect, c) for c in contenders]

    def _restarted(self, base: Point, contenders: Sequence[Contender]) -> Point:
        """The best fit with the base's effects from the drift of the best contenders."""
        ranked = sorted(_points(contenders), key=lambda p: p.cost)[:RESTARTS]
        starts = [replace(p, effects=base.effects) for p in ranked if base.cost - p.cost > WORTH]
        tasks = [Task(base=p, runs=self._runs) for p in starts]
        again = self._pool.map(refit, self._recipe, tasks)
        return min([base, *again], key=lambda p: p.cost)

    def _stand(
        self, final: Point, last: Sequence[Contender]
    ) -> tuple[Point, dict[str, dict[str, float]]]:
        """Let every effect but the last stand the contest again; take the best in its place."""
        rivals = {final.effects[-1]: _costs(last)}
        for name in final.effects[:-1]:
            rest = tuple(e for e in final.effects if e != name)
            tasks = [Task(base=replace(final, effects=rest), runs=self._runs)]
            (without,) = self._pool.map(refit, self._recipe, tasks)
            without, found = self._further(without, "standing again")
            best = _best(found)
            rivals[name] = _costs(found)
            if best is not None and best.cost < final.cost - MARGIN:
                other = best.effects[-1]
                rivals[other] = rivals.pop(name)
                final = best
        return final, rivals

    def _told(self, stage: str, tasks: Sequence[Task], found: Iterator[Found]) -> list[Found]:
        """All that is found, told as it comes."""
        every = []
        for done, one in enumerate(found):
            if self._progress is not None:
                self._progress(stage, (done + 1) / len(tasks))
            every.append(one)
        return every


def _explained(contenders: Sequence[Contender]) -> bool:
    """Whether an effect leaves nothing but noise."""
    return any(point.chi_squared <= NOISE_LEFT for point in _points(contenders))


def _contender(name: str, shown: Signature | None, point: Point | None) -> Contender:
    if shown is None:
        return Contender(effect=name, norm=0.0, raw=0.0, imitated_by="", point=None)
    return Contender(
        effect=name, norm=shown.norm, raw=shown.raw, imitated_by=shown.imitated_by, point=point
    )


def _better(first: Sequence[Contender], second: Sequence[Contender]) -> list[Contender]:
    """Of two fits of the same effect the better one."""
    others = {c.effect: c for c in second if c.point is not None}
    return [
        min(c, others.get(c.effect, c), key=lambda o: o.point.cost if o.point else np.inf)
        for c in first
    ]


def _points(contenders: Sequence[Contender]) -> Iterator[Point]:
    return (c.point for c in contenders if c.point is not None)


def _best(contenders: Sequence[Contender]) -> Point | None:
    return min(_points(contenders), key=lambda p: p.cost, default=None)


def _costs(contenders: Sequence[Contender]) -> dict[str, float]:
    return {c.effect: c.point.cost for c in contenders if c.point is not None}
