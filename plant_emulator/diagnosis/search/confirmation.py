"""Fits a hypothesis by simulation, from the linear estimate of its effects.

Each start is tried at some positions in the gap and at some sizes. A loss judges them that bears
spikes at the wrong time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitValues
from plant_emulator.diagnosis.fitting.joint_fit import approach, fit, linearise
from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.search.settings import SETTINGS
from plant_emulator.estimation.robust_scan import cauchy_loss
from plant_emulator.model.stage import GAP_POSITION

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.promise import Start


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A hypothesis to fit: its effects, the runs, and where the fit may begin."""

    effects: tuple[str, ...]
    runs: tuple[int, ...]
    starts: tuple[Start, ...]


def confirm(model: Model, trial: Trial) -> FitResult:
    """Fit a hypothesis for a few iterations from its best start (a step).

    The nominal parameters are one more start. Far from the data the linear estimate of a size says
    little, and the plausible size at the nominal parameters is another.
    """
    nominal = [
        replace(one, values={**one.values, **model.nominal(trial.runs)}) for one in trial.starts[:1]
    ]
    placed = [_scan_gap_positions(model, trial, one) for one in (*trial.starts, *nominal)]
    if trial.effects:
        placed = [_scan_size(model, trial, *pair) for pair in placed]
        placed += [(np.inf, _plausible(model, trial, one)) for one in nominal]
    near = approach(
        model,
        [
            FitValues(effects=trial.effects, values=one.values, states=one.states)
            for _, one in sorted(placed, key=lambda pair: pair[0])
        ],
        trial.runs,
    )
    return fit(model, trial.effects, trial.runs, near.values, near.states, SETTINGS.iterations)


def look(model: Model, trial: Trial) -> FitResult:
    """Fit a hypothesis from its best start with slopes that are differenced only there (a step)."""
    _, best = min(
        (_scan_gap_positions(model, trial, one) for one in trial.starts), key=lambda pair: pair[0]
    )
    near = linearise(
        model, FitValues(effects=trial.effects, values=best.values, states=best.states), trial.runs
    )
    return fit(
        model,
        trial.effects,
        trial.runs,
        best.values,
        best.states,
        SETTINGS.iterations,
        near=near,
    )


def _scan_gap_positions(model: Model, trial: Trial, start: Start) -> tuple[float, Start]:
    """Scan the gap position of each run; return the least loss and its start."""
    total, states = 0.0, []
    for k, own in zip(trial.runs, start.states, strict=True):
        residual = model.rough().residual(k, trial.effects)
        trials = [dict(own)]
        if GAP_POSITION in own:
            positions = np.linspace(-1.0, 1.0, SETTINGS.gap_positions)
            trials += [{**own, GAP_POSITION: float(g)} for g in positions]
        losses = [cauchy_loss(residual({**start.values, **one})) for one in trials]
        best = int(np.argmin(losses))
        total += losses[best]
        states.append(trials[best])
    return total, replace(start, states=tuple(states))


def _plausible(model: Model, trial: Trial, start: Start) -> Start:
    """The start with the plausible size of the last effect, and the states that suit it.

    The size is on the start's side of neutral.
    """
    candidate = model.candidates[trial.effects[-1]]
    neutral = candidate.neutral
    sides = [
        (start.values[u.name] - neutral[u.name]) * (u.start - neutral[u.name])
        for u in candidate.sizes
    ]
    size = -1.0 if sum(sides) < 0.0 else 1.0
    values = {**start.values, **values_at_size(candidate, size)}
    states = tuple(model.initial_states(k, trial.effects, values) for k in trial.runs)
    return replace(start, values=values, states=states)


def _scan_size(model: Model, trial: Trial, loss: float, start: Start) -> tuple[float, Start]:
    """Scan the size of the last effect; return the least loss and its start."""
    candidate = model.candidates[trial.effects[-1]]
    residuals = [model.rough().residual(k, trial.effects) for k in trial.runs]
    neutral, plausible = candidate.neutral, {u.name: u.start for u in candidate.sizes}
    offsets = {name: start.values[name] - neutral[name] for name in plausible}
    size = max(abs(offsets[name] / (plausible[name] - neutral[name])) for name in plausible)
    best = loss, start
    for wanted in SETTINGS.trial_sizes if size > 0.0 else ():
        values = dict(start.values)
        for u in candidate.sizes:
            value = neutral[u.name] + wanted / size * offsets[u.name]
            values[u.name] = float(np.clip(value, u.lower, u.upper))
        total = sum(
            cauchy_loss(residual({**values, **own}))
            for residual, own in zip(residuals, start.states, strict=True)
        )
        best = min(best, (total, replace(start, values=values)), key=lambda pair: pair[0])
    return best
