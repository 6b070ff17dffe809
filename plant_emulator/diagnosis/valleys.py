"""The best of several values of an unknown while the others stay, by a loss that forgives.

Where contact comes and goes the squares have many valleys, and a slope leads only to the next.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.estimates import Array

# How far sizes of many valleys are looked for, in plausible sizes.
WIDEST = 3.0


def best_states(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> tuple[dict[str, float], ...]:
    """States of every run, each the best of some values while the others stay, two times over.

    One of many narrow valleys is where its signature has found it, and stays.
    """
    every = (*model.states, *(u for name in effects for u in model.candidates[name].states))
    own = [u for u in every if u.step is None]
    found = []
    for k, state in zip(runs, states, strict=True):
        best = dict(state)
        for u in (*own, *own):
            trials = [{**best, u.name: value} for value in (best[u.name], *u.starts())]
            losses = [loss_of(model, effects, [k], values, [trial]) for trial in trials]
            best = trials[int(np.argmin(losses))]
        found.append(best)
    return tuple(found)


def best_sizes(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> dict[str, float]:
    """The values, sizes of many valleys the best of many while all else stays."""
    best = dict(values)
    for candidate in (model.candidates[name] for name in effects):
        for u in candidate.sizes:
            if u.step is None:
                continue
            neutral = candidate.neutral[u.name]
            sizes = np.arange(neutral, neutral + WIDEST * (u.start - neutral), u.step)
            trials = [{**best, u.name: float(size)} for size in (best[u.name], *sizes)]
            losses = [loss_of(model, effects, runs, trial, states) for trial in trials]
            best = trials[int(np.argmin(losses))]
    return best


def loss_of(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> float:
    """Loss of all runs that forgives."""
    return forgiven(whole(model, effects, runs, values, states))


def whole(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> Array:
    """Residual of all runs."""
    every = [
        model.residual(k, effects)({**values, **state})
        for k, state in zip(runs, states, strict=True)
    ]
    return np.concatenate([residual.ravel() for residual in every])


def forgiven(residual: Array) -> float:
    """Sum of log(1 + r^2): what lies far off counts, but little more than near."""
    return float(np.sum(np.log1p(residual**2)))
