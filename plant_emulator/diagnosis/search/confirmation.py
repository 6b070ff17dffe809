"""Fits a hypothesis by simulation, from the linear estimate of its effects."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fit_result import FitValues
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import approach, fit
from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.promise import Start


@dataclass(frozen=True)
class Trial:
    """A hypothesis to fit: its effects, the runs, and where the fit may begin.

    iterations : of the last, free fit at most so many; None: until it converges
    """

    effects: tuple[str, ...]
    runs: tuple[int, ...]
    starts: tuple[Start, ...]
    iterations: int | None = None


def confirm(model: Model, trial: Trial) -> FitResult:
    """Fit a hypothesis from its best start (a step).

    The nominal parameters with the plausible size are one more start: far from the data the linear
    estimate of a size says little. A set of effects is also fitted from its starts as they are,
    which are hardly worse than the smaller set.
    """
    nominal = [
        _plausible(model, trial, replace(one, values={**one.values, **model.nominal(trial.runs)}))
        for one in trial.starts[:1]
    ]
    starts = [
        FitValues(effects=trial.effects, values=one.values, states=one.states)
        for one in (*trial.starts, *nominal)
    ]
    far = NOISE_MEAN_SQUARE if len(trial.effects) > 1 else SUSPECT_MEAN_SQUARE
    near = [approach(model, starts, trial.runs, far)]
    own = starts[len(trial.starts) - 1]
    if len(trial.effects) > 1 and near[0] is not own:
        near.append(own)
    found = [
        fit(model, trial.effects, trial.runs, one.values, one.states, trial.iterations)
        for one in near
    ]
    return min(found, key=lambda one: one.cost)


def _plausible(model: Model, trial: Trial, start: Start) -> Start:
    """The start with the plausible size of the last effect, and the states that suit it.

    The size is on the start's side of neutral.
    """
    if not trial.effects:
        return start
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
