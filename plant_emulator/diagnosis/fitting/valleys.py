"""The best of several values of an unknown while the others stay, by Cauchy's loss.

Where contact comes and goes the squares have many valleys, and a slope leads only to the next.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.robust_scan import cauchy_loss, scan_unknowns

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Unknown
    from plant_emulator.signals.log import Array

# How far sizes of many valleys are looked for, in plausible sizes.
WIDEST = 3.0


def best_states(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
    *,
    anew: Sequence[str],
) -> tuple[dict[str, float], ...]:
    """States of every run, each but those of many narrow valleys the best of some values while the
    others stay, two times over.

    anew : effects whose states of many valleys are then tried together: a signature at a fit that
        lacks an effect may have found the wrong one
    """
    of_effects = [u for name in effects for u in model.candidates[name].states]
    own = [u for u in (*model.states, *of_effects) if u.step is None]
    groups = [model.candidates[name].states for name in anew]
    together = [g for g in groups if any(u.step is not None for u in g)]
    found = []
    for k, state in zip(runs, states, strict=True):
        best = dict(state)
        for u in (*own, *own):
            trials = [{**best, u.name: value} for value in (best[u.name], *u.starts())]
            best = min(trials, key=lambda s: loss_of(model, effects, [k], values, [s]))
        for group in together:
            best = _together(model, effects, k, values, best, group)
        found.append(best)
    return tuple(found)


def _together(
    model: Model,
    effects: Sequence[str],
    run: int,
    values: Mapping[str, float],
    state: Mapping[str, float],
    unknowns: Sequence[Unknown],
) -> dict[str, float]:
    """States of a run with these tried all together, or as they are where that is better."""
    residual = model.residual(run, effects)
    anew = scan_unknowns(lambda v: residual({**values, **v}), state, unknowns)
    return min(dict(state), anew, key=lambda s: loss_of(model, effects, [run], values, [s]))


def best_sizes(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> dict[str, float]:
    """The values, of the last effect's sizes and shapes of many valleys the best of many while all
    else stays.
    """
    best, candidate = dict(values), model.candidates[effects[-1]]
    for u in (*candidate.sizes, *candidate.shapes):
        if u.step is None:
            continue
        trials = [{**best, u.name: value} for value in (best[u.name], *_spread(candidate, u))]
        best = min(trials, key=lambda v: loss_of(model, effects, runs, v, states))
    return best


def _spread(candidate: Candidate, unknown: Unknown) -> list[float]:
    """Values of a size about neutral, or of a shape over what is known of it, within its bounds."""
    if unknown.name not in candidate.neutral:
        return unknown.starts()
    neutral = candidate.neutral[unknown.name]
    reach = WIDEST * abs(unknown.start - neutral)
    low, high = max(unknown.lower, neutral - reach), min(unknown.upper, neutral + reach)
    return [float(value) for value in np.arange(low, high, unknown.step)]


def loss_of(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> float:
    """Cauchy's loss of all runs."""
    return cauchy_loss(whole(model, effects, runs, values, states))


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
