"""Fits as steps: functions of a model and plain data, for a pool to run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.approach import approach_null, lead
from plant_emulator.diagnosis.fitting.joint_fit import fit_from

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model


def simulate_once(model: Model, run: int) -> None:
    """Simulate a run, so that this process has the compiled code when it is asked (a step)."""
    states = {u.name: u.start for u in model.states}
    model.residual(run, ())({**model.nominal((run,)), **states})


def start(model: Model, runs: tuple[int, ...]) -> tuple[FitResult, FitResult | None]:
    """The fit without effects, and the best led fit on the way to it (a step).

    See `approach.approach_null`.
    """
    return approach_null(model, runs)


def refit(model: Model, task: Task) -> FitResult:
    """The fit of `task.base` with the effects named there, from its values (a step)."""
    return fit_from(model, task.base.effects, task.runs, task.base)


def refit_along(model: Model, task: Task) -> FitResult:
    """The fit of `task.base` with its effects, led along the measured outputs (a step).

    See `approach.lead`.
    """
    return lead(model, task.base, task.runs)
