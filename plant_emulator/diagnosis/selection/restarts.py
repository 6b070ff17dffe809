"""Fits started again from elsewhere: where contact comes and goes, the cost has many valleys."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import excess
from plant_emulator.diagnosis.fitting.joint_fit import WORTHWHILE_FALL
from plant_emulator.diagnosis.fitting.steps import advance, follow, refit, shake, sift, swap
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.selection.rules import noise_only
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult

# Times that a fit that ran out of steps is taken up again.
PATIENCE = 3
# How often a fit starts again, once with wide slopes and else from some way off.
SHAKES = 3
# How far a valley is followed beyond a step along it [such steps], how often, and how many times in
# a row in vain.
STRIDES, FOLLOWED, FAILED = (1.0, 3.0, 7.0), 6, 2
# Costs that differ by no more are of the same place [gap].
SAME = 0.03
# Effects that are fitted in the place of another, and steps that the best of them goes further.
SWAPPED, SIFTS = 2, 3


@dataclass(frozen=True, kw_only=True)
class Restarts:
    """The restarts of one diagnosis on its pool; runs : by number."""

    runner: TaskRunner

    def refitted(self, point: FitResult) -> FitResult:
        """A fit to convergence from where another has come to."""
        (found,) = self.runner.map(refit, [Task(base=point, runs=self.runner.runs)])
        return found

    def settled(self, final: FitResult) -> FitResult:
        """The fit taken up again where it ran out of steps."""
        for _ in range(PATIENCE):
            if final.converged:
                break
            final = self.refitted(final)
        return final

    def sifted(self, points: Sequence[FitResult]) -> list[FitResult]:
        """Fits; of those that leave much the better of itself and that from the best values of
        each of its unknowns.
        """
        far = {
            k: point for k, point in enumerate(points) if point.mean_square > SUSPECT_MEAN_SQUARE
        }
        tasks = [Task(base=point, runs=self.runner.runs) for point in far.values()]
        found = dict(zip(far, self.runner.map(sift, tasks), strict=True))
        return self._ended(points, found)

    def shaken(self, points: Sequence[FitResult]) -> list[FitResult]:
        """Fits, each the best of itself, that with wide slopes and those from some way off."""
        off = self._off(points, range(SHAKES))
        best = [min(found, key=lambda p: p.cost) for found in off]
        return self._ended(points, dict(enumerate(best)))

    def _off(self, points: Sequence[FitResult], numbers: Sequence[int]) -> list[list[FitResult]]:
        """For every fit, those from some way off, each number another way; 0: with wide slopes."""
        tasks = [
            Task(base=point, runs=self.runner.runs, number=k) for point in points for k in numbers
        ]
        found = list(self.runner.map(shake, tasks))
        each = len(numbers)
        return [found[each * k : each * (k + 1)] for k in range(len(points))]

    def swapped(self, point: FitResult, names: Sequence[str]) -> FitResult:
        """The fit with the likeliest of these effects in the place of the last, from that fit.

        Drift that has followed the wrong effect goes a long way back, through many valleys.
        """
        tasks = [Task(base=point, runs=self.runner.runs, effect=name) for name in names]
        found = sorted(self.runner.map(swap, tasks), key=lambda pair: pair[0])
        likely = [start for _, start in found[:SWAPPED]]
        for step in (follow, sift):
            tasks = [Task(base=p, runs=self.runner.runs) for p in likely]
            likely = list(self.runner.map(step, tasks))
        best = min(likely, key=lambda p: p.cost)
        for step in (*[sift] * SIFTS, refit):
            (again,) = self.runner.map(step, [Task(base=best, runs=self.runner.runs)])
            best = min(best, again, key=lambda p: p.cost)
        return best

    def followed(self, point: FitResult, *, to_noise: bool = True) -> FitResult:
        """The fit followed down a long valley, in whose rough bottom fits stop on the way.

        From where it has come to and where a start from some way off has, further the same way, as
        a pattern move (R. Hooke, T. A. Jeeves, J. ACM 8 (1961) 212).

        to_noise : no further than where it leaves nothing but noise
        """
        failed = 0
        for k in range(FOLLOWED):
            if (to_noise and noise_only(point)) or failed == FAILED:
                break
            numbers = range(SHAKES * k, SHAKES * (k + 1))
            off = self._off([point], numbers)[0]
            (moved,) = self._ended([point], {0: min(off, key=lambda p: p.cost)})
            step = WORTHWHILE_FALL + SAME * excess(point)
            if moved.cost < point.cost - step:
                ahead = [further(point, moved, stride) for stride in STRIDES]
                point, failed = self.lowest(moved, ahead), 0
                continue
            point, failed = moved, failed + 1
        return point

    def lowest(self, point: FitResult, starts: Sequence[FitResult]) -> FitResult:
        """A fit, or the best of some steps from these starts, where that is better, to the end."""
        tasks = [Task(base=start, runs=self.runner.runs) for start in starts]
        found = list(self.runner.map(advance, tasks))
        best = min([point, *found], key=lambda p: p.cost)
        return self._ended([point], {0: best})[0]

    def _ended(
        self, points: Sequence[FitResult], found: Mapping[int, FitResult]
    ) -> list[FitResult]:
        """Fits, or what was found in their place where that is better, to convergence."""
        lower = {k: new for k, new in found.items() if new.cost < points[k].cost - WORTHWHILE_FALL}
        tasks = [Task(base=new, runs=self.runner.runs) for new in lower.values()]
        ended = dict(zip(lower, self.runner.map(refit, tasks), strict=True))
        return [ended.get(k, point) for k, point in enumerate(points)]


def further(first: FitResult, second: FitResult, stride: float) -> FitResult:
    """A start that goes on from one fit through another, by so many times their difference."""

    def beyond(before: Mapping[str, float], after: Mapping[str, float]) -> dict[str, float]:
        return {name: value + stride * (value - before[name]) for name, value in after.items()}

    states = [beyond(a, b) for a, b in zip(first.states, second.states, strict=True)]
    return replace(second, values=beyond(first.values, second.values), states=tuple(states))
