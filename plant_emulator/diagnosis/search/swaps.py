"""Effects that may take the place of one that a fit has.

Two effects may explain the same, and a fit with the true one may end in a local minimum where a fit
with the other one does not. Around a fit that is near the data regressions hold: with one of its
effects absent, by slopes, they tell how much of what that effect explains each other one does. A
scale of the motor's speed explained half of what one of the drum's speed did beside a sagging
voltage, and a fit that began there explained more.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import fit_from
from plant_emulator.diagnosis.search.screening import score_nearby, visible
from plant_emulator.diagnosis.search.settings import SETTINGS
from plant_emulator.diagnosis.search.simulation_columns import SimulationColumns
from plant_emulator.estimation.regression import gain

if TYPE_CHECKING:
    from collections.abc import Iterator

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model


def swaps(model: Model, task: Task) -> list[FitResult]:
    """Where fits begin with another effect in the place of each one of `task.base` (a step).

    Their costs are those of the base.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        columns = SimulationColumns(model, task.base, task.runs)
        return [one for name in task.base.effects for one in _in_place_of(name, task.base, columns)]


def fit_swap(model: Model, task: Task) -> FitResult:
    """Fit `task.base` for as long as a rival (a step)."""
    return fit_from(model, task.base.effects, task.runs, task.base, SETTINGS.iterations)


def _in_place_of(effect: str, base: FitResult, columns: SimulationColumns) -> Iterator[FitResult]:
    """Where fits begin with another effect in the place of this one."""
    model, absent = columns.model, columns.without(effect)
    products = absent.data.products(np.reshape(absent.change, (-1, 1)))
    explained, _ = gain(products.gram, products.along)
    neutral = model.candidates[effect].neutral
    for name, candidate in visible(model, base, columns.runs).items():
        plain = [{u.name: u.start for u in candidate.states} for _ in columns.runs]
        score = score_nearby(absent, candidate, plain)
        if score is None or score.gain < SETTINGS.rival_share * explained:
            continue
        values, states = absent.values_at(score.theta)
        yield replace(
            base,
            effects=(*(e for e in base.effects if e != effect), name),
            values={**base.values, **neutral, **values, **score.values},
            states=tuple(
                {**fit, **own, **more}
                for fit, own, more in zip(base.states, states, score.states, strict=True)
            ),
        )
