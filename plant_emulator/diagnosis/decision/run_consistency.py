"""The run consistency test: whether runs that disagree together agree with the equations alone.

A gap without a name may lie between the runs. Then each run alone comes down to the noise, and a
parameter that no run should change differs between two of them. Friction may differ, because oil
warms and cools.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import Quantity
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.wording import size

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model

# A parameter differs between two runs from so many standard errors on.
DIFFERENT_ERRORS = 5.0
# Mean square up to which a run alone agrees with the equations.
CONSISTENT_MEAN_SQUARE = 1.1
# Parameters that oil changes have this in their name.
CHANGED_BY_OIL = "friction"


def fit_alone(model: Model, task: Task) -> FitResult:
    """Fit without effects to the task's runs only (a step)."""
    return fit_null(model, task.runs)


def inconsistency(model: Model, runs: Sequence[int], alone: Sequence[FitResult]) -> str:
    """The parameter that differs most between two runs, as a sentence; empty where none does.

    alone : fit of each of these runs alone
    """
    alike = all(found.mean_square <= CONSISTENT_MEAN_SQUARE for found in alone)
    if not alike or not all(found.converged for found in alone):
        return ""
    pairs = [
        (_difference(name, a, b), name, (k, a), (j, b))
        for (k, a), (j, b) in combinations(zip(runs, alone, strict=True), 2)
        for name in (u.name for u in model.parameters if CHANGED_BY_OIL not in u.name)
    ]
    most, name, first, second = max(pairs, key=lambda pair: pair[0], default=(0.0, "", None, None))
    if first is None or second is None or most <= DIFFERENT_ERRORS:
        return ""
    return (
        "each log alone fits, but with other values: "
        f"{name} is {_describe(model, name, *first)} and {_describe(model, name, *second)}; two "
        "machines, a change between, or an unknown effect"
    )


def _difference(name: str, a: FitResult, b: FitResult) -> float:
    """Difference of a parameter between two fits [standard errors]."""
    error = float((_variance(name, a) + _variance(name, b)) ** 0.5)
    return abs(a.values[name] - b.values[name]) / error if error > 0.0 else 0.0


def _variance(name: str, found: FitResult) -> float:
    """Variance of an estimate [unit^2], enlarged by the misfit and the autocorrelation."""
    variance = found.standard_errors[name] ** 2
    return variance * max(1.0, found.mean_square) / found.effective_fraction


def _describe(model: Model, name: str, run: int, found: FitResult) -> str:
    """Estimate of a parameter in a run, and the run's file with its folder."""
    value = size(
        Quantity(
            name=name,
            value=found.values[name],
            standard_error=found.standard_errors[name],
            unit=model.units[name],
        )
    )
    return f"{value} in {'/'.join(model.runs[run].source.split('/')[-2:])}"
