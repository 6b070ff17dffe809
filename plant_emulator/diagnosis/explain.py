"""Which effects the logs ask for: forward and backward steps through the contest.

Forward: the effect whose joint fit lowers the cost most comes in, as long as its evidence counts
and the gap is not closed. After every addition each earlier effect has to stand the contest again,
with all others in its place; and at the end each has to be missed when it is taken out.

Evidence is the fall of the penalised sum of squares, over the mean square that the better model
leaves (at least 1, the noise), times the share of its samples that are independent. A model that
leaves much more than the noise leaves something correlated, which makes wrong effects count; its
share is then taken no larger than that of the fit without effects.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from plant_emulator.diagnosis.contest import (
    ASTRAY,
    WORTH,
    Point,
    Tangents,
    again,
    from_nominal,
    joint,
    linearised,
    null_fit,
    signature,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.diagnosis.pool import Pool, Recipe

    Progress = Callable[[str, float], None]

Found = TypeVar("Found")

# Evidence from which on an effect counts.
THRESHOLD = 25.0
# Effects whose evidence differs by less cannot be told apart: odds of 150 to 1.
MARGIN = 10.0
# Drift-free signature at its plausible size from which on an effect is detectable, in the noise.
DETECTABLE = 7.0
# What the noise of a log is known to, as a part of its square.
NOISE_KNOWN = 0.02
# Share of the gap that may be left for the cause to be known, with one effect and with more.
LEFT, LEFT_OF_MORE = 0.1, 0.04
# Share of the gap that a further effect has to close to be named.
FURTHER = 0.04
# Mean square up to which a model leaves nothing but noise.
NOISE_LEFT = 1.05
# Share of the gap that a better fit without effects closes when it has moved to another valley.
MOVED = 0.1
# Mean square from which on a model leaves more than what the noise explains.
MISFIT = 1.5
MOST_EFFECTS = 3
RESTARTS = 3
# Best of a round that are fitted to convergence.
POLISHED = 5
# Fall of the sum of squares that a signature has to promise to be fitted.
HOPELESS = 4.0


@dataclass(frozen=True, kw_only=True)
class Contender:
    """An effect in the contest.

    norm : of its drift-free signature at the plausible size; raw : without removing drift
    point : its joint fit; None where its signature vanishes
    """

    effect: str
    norm: float
    raw: float
    imitated_by: str
    point: Point | None


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """What the contest came to.

    null : the fit without effects; final : with those accepted
    contenders : of the first round, all effects of the library
    rivals : for every accepted effect the costs of all that took its place
    unconverged : why the answer cannot be trusted; empty where it can
    """

    null: Point
    final: Point
    contenders: tuple[Contender, ...]
    rivals: dict[str, dict[str, float]]
    unconverged: str

    def evidence(self, contender: Contender) -> float:
        """Evidence of an effect alone."""
        if contender.point is None:
            return 0.0
        best = min(self.final, contender.point, key=lambda p: p.chi_squared)
        return weighed(self.null.cost - contender.point.cost, best, self.null)

    def classes(self) -> list[list[str]]:
        """For every accepted effect those that these logs cannot tell from it, itself first."""
        found = []
        for name, costs in self.rivals.items():
            near = [
                other
                for other, cost in sorted(costs.items(), key=lambda pair: pair[1])
                if other != name and weighed(cost - self.final.cost, self.final, self.null) < MARGIN
            ]
            found.append([name, *near])
        return found


def weighed(fall: float, better: Point, null: Point) -> float:
    """Evidence of a fall of the cost, see the module's text."""
    share = better.share
    if better.chi_squared > MISFIT:
        share = min(share, null.share)
    return max(0.0, fall) / max(1.0, better.chi_squared) * share


def excess(point: Point) -> float:
    """Sum of squares beyond what the noise explains."""
    return max(0.0, point.squares - (1.0 + NOISE_KNOWN) * point.samples)


def adequate(point: Point, null: Point) -> bool:
    """Whether a model leaves so little of the gap that its cause is known."""
    left = LEFT if len(point.effects) <= 1 else LEFT_OF_MORE
    return excess(point) <= max(left * excess(null), THRESHOLD)


@dataclass(frozen=True, kw_only=True)
class Task:
    """One step: an effect, or none, on top of a fit, on these runs."""

    base: Point
    runs: tuple[int, ...]
    effect: str = ""


def start(model: Model, runs: tuple[int, ...]) -> Point:
    """The fit without effects."""
    return null_fit(model, runs)


def contend(model: Model, task: Task) -> Contender:
    """One effect in the contest; not fitted where neither its signature nor its tangent helps.

    An effect with states of its own is always fitted: its signature is that of one start state, and
    says little of others.
    """
    found = signature(model, task.effect, task.base, task.runs, _tangents(model, task))
    if found is None:
        return Contender(effect=task.effect, norm=0.0, raw=0.0, imitated_by="", point=None)
    plain = not model.candidates[task.effect].states
    hopeless = plain and max(found.gain, found.tangent_gain) < HOPELESS
    return Contender(
        effect=task.effect,
        norm=found.norm,
        raw=found.raw,
        imitated_by=found.imitated_by,
        point=None if hopeless else joint(model, found, task.base, task.runs),
    )


def once_more(model: Model, task: Task) -> Point:
    """The joint fit of an effect from the nominal parameters."""
    return from_nominal(model, task.effect, task.base, task.runs)


# The tangents of the fit that this process was last asked about: every effect asks for the same.
_last: dict[tuple[int, tuple[object, ...]], Tangents] = {}


def _tangents(model: Model, task: Task) -> Tangents:
    key = (id(model), task.base.key)
    if key not in _last:
        _last.clear()
        _last[key] = Tangents(linearised(model, task.base, task.runs))
    return _last[key]


def refit(model: Model, task: Task) -> Point:
    """The fit of `task.base` with the effects named there, from its values."""
    return again(model, task.base.effects, task.runs, task.base)


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

    def explain(self) -> Explanation:
        """Go through the contest."""
        (null,) = self._pool.map(start, self._recipe, [self._runs])
        null, contenders = self._round(null, "contest")
        final = null
        rivals: dict[str, dict[str, float]] = {}
        while len(final.effects) < MOST_EFFECTS and not self._enough(final, null):
            found = contenders if not final.effects else self._round(final, "further effects")[1]
            best = _best(found)
            if best is None or not self._counts(best, final, null):
                break
            final = best
            final, rivals = self._stand(final, found)
        return Explanation(
            null=null,
            final=final,
            contenders=tuple(contenders),
            rivals=rivals,
            unconverged="" if final.converged else "the last fit did not converge",
        )

    def _enough(self, final: Point, null: Point) -> bool:
        return bool(final.effects) and excess(final) <= max(LEFT_OF_MORE * excess(null), THRESHOLD)

    def _counts(self, best: Point, base: Point, null: Point) -> bool:
        """Whether one more effect earns its place."""
        fall = base.cost - best.cost
        counts = weighed(fall, best, null) > THRESHOLD
        if not self._reaches_noise:
            return counts
        further = excess(null) > THRESHOLD and fall > FURTHER * excess(null)
        if base.effects:
            return fall > THRESHOLD and further
        # The first of several effects leaves a correlated rest: it is judged by the gap as well.
        return counts or (fall > THRESHOLD and further)

    def _round(self, base: Point, stage: str) -> tuple[Point, list[Contender]]:
        """All effects on top of a fit; the fit itself started again from the best of them.

        Unless one of them leaves nothing but noise, all are tried again where that fit has moved to
        another valley, and all start once more from the nominal parameters where it leaves much.
        """
        contenders = self._contend(base, stage)
        better = self._restarted(base, contenders)
        if _explained(contenders):
            return better, contenders
        if base.cost - better.cost > max(THRESHOLD, MOVED * excess(base)):
            contenders = _better(contenders, self._contend(better, stage))
        if better.chi_squared > ASTRAY and not _explained(contenders):
            contenders = _better(contenders, self._from_nominal(better, contenders, stage))
            better = self._restarted(better, contenders)
        return better, contenders

    def _from_nominal(
        self, base: Point, contenders: Sequence[Contender], stage: str
    ) -> list[Contender]:
        """All effects that show at all, fitted from the nominal parameters."""
        moving = [c for c in contenders if c.norm > 0.0]
        tasks = [Task(base=base, runs=self._runs, effect=c.effect) for c in moving]
        points = self._told(stage, tasks, self._pool.map(once_more, self._recipe, tasks))
        return self._polished([replace(c, point=p) for c, p in zip(moving, points, strict=True)])

    def _contend(self, base: Point, stage: str) -> list[Contender]:
        names = [name for name in self._names if name not in base.effects]
        tasks = [Task(base=base, runs=self._runs, effect=name) for name in names]
        found = self._told(stage, tasks, self._pool.map(contend, self._recipe, tasks))
        return self._polished(found)

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
            found = self._contend(without, "standing again")
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
