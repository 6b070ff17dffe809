"""The fit without effects, and the drift of some of its runs, from which a contest may start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import excess
from plant_emulator.diagnosis.fitting.steps import spread, start
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.selection.rules import noise_only

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult

# Mean square that a fit to a few runs leaves where its drift is one to start from on all.
LITTLE = 2.0
# What all runs leave alone, as a part of what they leave together, where the fit to all may be
# astray.
APART = 0.2


@dataclass(frozen=True, kw_only=True)
class Drifts:
    """The fits without effects of one diagnosis on its pool; runs : by number."""

    runner: TaskRunner

    def of_all(self) -> FitResult:
        """The fit to all runs."""
        (null,) = self.runner.map(start, [self.runner.runs])
        return null

    def of_some(self, null: FitResult) -> tuple[list[FitResult], bool]:
        """Drift of some runs as it is on all, to start from; and whether these need no effect.

        Runs that need none show drift that no effect has led astray, and the others show the effect
        that they need as it is. Otherwise that of runs that leave little; or that of every run,
        where they leave much less alone than together. Empty where it is none of these.

        null : the fit to all runs
        """
        found = self.runner.map(start, [(run,) for run in self.runner.runs])
        alone = dict(zip(self.runner.runs, found, strict=True))
        for enough in (noise_only, _little):
            runs = tuple(run for run, point in alone.items() if enough(point))
            if not 1 < len(runs) < len(self.runner.runs):
                continue
            (joint,) = self.runner.map(start, [runs])
            if enough(joint):
                return self._spread({runs: joint}), enough is noise_only
        if sum(map(excess, alone.values())) >= APART * excess(null):
            return [], False
        return self._spread({(run,): point for run, point in alone.items()}), False

    def _spread(self, points: Mapping[tuple[int, ...], FitResult]) -> list[FitResult]:
        """Fits to some runs as they are on all, by these runs."""
        tasks = [
            Task(base=point, runs=self.runner.runs, known=runs) for runs, point in points.items()
        ]
        return list(self.runner.map(spread, tasks))


def _little(point: FitResult) -> bool:
    """Whether a fit leaves little enough to have its drift from."""
    return point.mean_square <= LITTLE
