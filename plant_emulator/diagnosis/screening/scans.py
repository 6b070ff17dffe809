"""Scans of unknowns with many basins: the pause of a converter, a frequency, an angle.

Regressions tell little of such an unknown, because contact jumps with it, or a wave is out of
phase. A scan with a robust loss finds its basin (`estimation.robust_scan`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.screening.promise import Start
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.nearby import Beside
from plant_emulator.estimation.robust_scan import cauchy_loss, scan_unknowns

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.signals.log import Array


def start_states(model: Model, asked: tuple[Task, Sequence[str]]) -> dict[str, dict[str, float]]:
    """States of these effects in the run of the task that their columns are taken at (a step).

    A state with many narrow basins, as a frequency, is scanned on top of a fit without effects.
    """
    task, effects = asked
    return {name: _start_states(model, model.candidates[name], task) for name in effects}


def _start_states(model: Model, candidate: Candidate, task: Task) -> dict[str, float]:
    where = task.base
    plain = {u.name: u.start for u in candidate.states}
    if where.effects or all(u.step is None for u in candidate.states):
        return plain
    (run,), (fit,) = task.runs, where.states
    values = {**where.values, **fit, **values_at_size(candidate, SETTINGS.sizes[0])}
    residual = model.residual(run, (candidate.name,))
    return scan_unknowns(Beside(residual, values), plain, candidate.states)


def scan_states(model: Model, found: FitResult, runs: Sequence[int]) -> Start:
    """A fit with those states of its last effect scanned that have many basins, or are angles."""
    own = model.candidates[found.effects[-1]].states
    states = tuple(
        _best(Beside(model.residual(k, found.effects), found.values), at, own)
        for k, at in zip(runs, found.states, strict=True)
    )
    return Start(values=found.values, states=states)


def scan_sizes(model: Model, effects: Sequence[str], runs: Sequence[int], start: Start) -> Start:
    """A start with those sizes of the last effect scanned that have many narrow basins.

    The scan goes as far from neutral as the largest size that is screened.
    """
    candidate = model.candidates[effects[-1]]
    narrow = [u for u in candidate.sizes if u.step is not None]
    if not narrow:
        return start
    of_runs = [
        Beside(model.residual(k, effects), {**start.values, **own})
        for k, own in zip(runs, start.states, strict=True)
    ]

    def residual(sizes: Mapping[str, float]) -> Array:
        return np.concatenate([one(sizes).ravel() for one in of_runs])

    present = {u.name: start.values[u.name] for u in narrow}
    found = _best(residual, present, [_within(candidate, u) for u in narrow])
    return replace(start, values={**start.values, **found})


def _best(
    residual: Residual, present: Mapping[str, float], unknowns: Sequence[Unknown]
) -> dict[str, float]:
    """The best of the present values and those of a scan."""
    scanned = scan_unknowns(residual, present, unknowns)
    return min((dict(present), scanned), key=lambda own: cauchy_loss(residual(own)))


def _within(candidate: Candidate, size: Unknown) -> Unknown:
    """A size with bounds no further from neutral than the largest size that is screened."""
    neutral = candidate.neutral[size.name]
    reach = max(SETTINGS.sizes) * abs(size.start - neutral)
    lower, upper = max(size.lower, neutral - reach), min(size.upper, neutral + reach)
    return replace(size, lower=lower, upper=upper)
