"""The gain of log evidence that the error of an approximate law can feign.

A law that is wrong by a relative error e changes the residual of a sample by up to e |a|, where a
is what its effect has closed there. Another effect that closes b follows no more of that than

    e^2 (sum |a| |b|)^2 / (2 sum b^2)

by the inequality of Cauchy and Schwarz at most e^2 of what the first effect has closed. An effect
that acts in other samples or channels feigns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.settings import SETTINGS

if TYPE_CHECKING:
    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class LawErrors:
    """The errors of the laws in one noise; rows : whitened residuals of fits that were asked."""

    rows: dict[tuple[object, ...], Array] = field(default_factory=dict)

    def feigned(
        self, runner: TaskRunner, null: FitResult, smaller: FitResult, larger: FitResult
    ) -> float:
        """Gain from one set to a larger one that approximate laws of the smaller may feign."""
        library = runner.model.candidates
        if all(library[name].exact_form for name in smaller.effects):
            return 0.0
        at_null, without, found = (self._rows(runner, one) for one in (null, smaller, larger))
        return feigned_gain(at_null - without, without - found, SETTINGS.law_error)

    def _rows(self, runner: TaskRunner, found: FitResult) -> Array:
        if found.key not in self.rows:
            task = Task(base=found, runs=runner.runs)
            (self.rows[found.key],) = runner.map(residual_rows, [task])
        return self.rows[found.key]


def residual_rows(model: Model, task: Task) -> Array:
    """Whitened residuals of all runs at the fit `task.base`, shape (n,) (a step)."""
    base = task.base
    rows = [
        model.residual(k, base.effects)({**base.values, **own})
        for k, own in zip(task.runs, base.states, strict=True)
    ]
    return np.concatenate([one.ravel() for one in rows])


def feigned_gain(closed: Array, more: Array, error: float) -> float:
    """Largest gain of log evidence that a law's error may feign.

    closed, more : what the effects of the law have closed, and what another effect closes beside
        them, in each sample [noise], shape (n,); error : relative error of the law [1]
    """
    square = float(more @ more)
    if square == 0.0:
        return 0.0
    return 0.5 * error**2 * float(np.abs(closed) @ np.abs(more)) ** 2 / square
