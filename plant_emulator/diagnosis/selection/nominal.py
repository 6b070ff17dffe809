"""Effects fitted from the nominal parameters: a second start, that no fit before has led astray."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import excess
from plant_emulator.diagnosis.fitting.steps import once_more, refit
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.fitting.valleys import WIDEST
from plant_emulator.diagnosis.selection.contenders import better_of, with_point

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Hypothesis
    from plant_emulator.diagnosis.selection.restarts import Restarts

# Best after a few steps that are fitted to convergence.
POLISHED = 4


@dataclass(frozen=True, kw_only=True)
class FromNominal:
    """Fits from the nominal parameters on a diagnosis's pool, none made twice.

    runs : by number
    """

    runner: TaskRunner
    restarts: Restarts
    # By the effects before and the last one: the points after a few steps, and at their end.
    _far: dict[tuple[object, str], FitResult] = field(default_factory=dict)
    _near: dict[tuple[object, str], FitResult] = field(default_factory=dict)

    def ended_at(self, point: FitResult) -> bool:
        """Whether a fit from the nominal parameters has ended there."""
        return point.key in {p.key for p in self._near.values()}

    def fitted(self, base: FitResult, contenders: Sequence[Hypothesis]) -> list[Hypothesis]:
        """The best of some effects fitted from the nominal parameters, from where a few steps come
        to and then from the best values of each unknown.

        A few steps from afar end anywhere, but seldom far from where the valley lies. None is made
        twice: without other effects the fit that they are on top of is of no account.
        """
        chosen = {(base.key if base.effects else (), c.effect): c for c in with_point(contenders)}
        new = [key for key in chosen if key not in self._far]
        tasks = [Task(base=base, runs=self.runner.runs, effect=chosen[key].effect) for key in new]
        found = list(self.runner.map(once_more, tasks))
        self._far.update(zip(new, found, strict=True))
        best = sorted(chosen, key=lambda key: self._far[key].cost)[:POLISHED]
        new = [key for key in best if key not in self._near]
        points = self.restarts.sifted([self._far[key] for key in new])
        tasks = [Task(base=point, runs=self.runner.runs) for point in points]
        ended = list(self.runner.map(refit, tasks))
        self._near.update(zip(new, ended, strict=True))
        return [replace(chosen[key], fit=self._near[key]) for key in best]

    def surveyed(self, contenders: Sequence[Hypothesis], base: FitResult) -> list[Hypothesis]:
        """All that could close the gap, from the nominal parameters where that is better."""
        able = [c for c in contenders if could_close(c.total_norm, base)]
        return better_of(contenders, self.fitted(base, able))


def could_close(raw: float, base: FitResult) -> bool:
    """Whether an effect, drift or not, changes as much as a fit leaves beyond the noise.

    raw : norm of what it changes at its plausible size
    """
    return (WIDEST * raw) ** 2 > excess(base)
