"""Whether runs that no model explains together agree with the equations each alone (pure).

A gap without a name may lie between the runs rather than in any of them. Then each run alone comes
down to the noise, and what no run should change differs. Friction may: oil warms and cools.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import Quantity
from plant_emulator.diagnosis.fitting.evidence import UNEXPLAINED_SHARE
from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.wording import size

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model

# Standard errors from which on a parameter differs between two runs.
DIFFERENT = 5.0
# Mean square up to which a run alone agrees with the equations.
AGREES = 1.1
# What oil changes, by a part of its name.
CHANGES = "friction"


def alone(model: Model, task: Task) -> FitResult:
    """Step of a diagnosis: the fit without effects of these runs only."""
    return fit_null(model, task.runs)


def between(
    model: Model, runs: Sequence[int], found: Sequence[FitResult], together: FitResult
) -> str:
    """What differs most between two of the runs, each fitted alone; empty: nothing is known to.

    together : the best fit of all of them
    """
    if any(not point.converged for point in found) or not _agree(model, found, together):
        return ""
    most, named = DIFFERENT, ("", "", "")
    for (k, a), (j, b) in combinations(zip(runs, found, strict=True), 2):
        for name in (u.name for u in model.parameters if CHANGES not in u.name):
            if _apart(name, a, b) > most:
                most = _apart(name, a, b)
                named = (name, _told(model, name, k, a), _told(model, name, j, b))
    if most <= DIFFERENT:
        return ""
    name, first, second = named
    return (
        f"each log alone fits, but with other values: {name} is {first} and {second}; two "
        "machines, a change between, or an unknown effect"
    )


def _agree(model: Model, found: Sequence[FitResult], together: FitResult) -> bool:
    """Whether each run alone agrees with the equations, in so far as the model can tell."""
    if model.reaches_noise:
        return all(point.mean_square <= AGREES for point in found)
    return (
        sum(point.sum_of_squares for point in found) <= UNEXPLAINED_SHARE * together.sum_of_squares
    )


def _apart(name: str, a: FitResult, b: FitResult) -> float:
    """Difference of a parameter of two fits in its standard errors, wider by what they leave."""
    error = float((_variance(name, a) + _variance(name, b)) ** 0.5)
    return abs(a.values[name] - b.values[name]) / error if error > 0.0 else 0.0


def _variance(name: str, point: FitResult) -> float:
    """Square of a standard error, by the residual and its autocorrelation."""
    return point.standard_errors[name] ** 2 * max(1.0, point.mean_square) / point.effective_fraction


def _told(model: Model, name: str, run: int, found: FitResult) -> str:
    """A parameter of a run, whose file is named with its folder."""
    value = size(
        Quantity(
            name=name,
            value=found.values[name],
            standard_error=found.standard_errors[name],
            unit=model.units[name],
        )
    )
    return f"{value} in {'/'.join(model.runs[run].source.split('/')[-2:])}"
