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
from plant_emulator.diagnosis.screening.screening import score_nearby
from plant_emulator.diagnosis.screening.simulation_columns import SimulationColumns
from plant_emulator.diagnosis.screening.visibility import visible
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.regression import gain

if TYPE_CHECKING:
    from collections.abc import Iterator

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.confirmation import Reduction


def swaps(model: Model, asked: Reduction) -> list[FitResult]:
    """Where fits begin with another effect in the place of one (a step).

    Their costs are those of the fit. States and sizes with many narrow basins are not scanned.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        return list(_in_its_place(model, asked))


def fit_swap(model: Model, task: Task) -> FitResult:
    """Fit `task.base` for as long as a rival (a step)."""
    return fit_from(model, task.base.effects, task.runs, task.base, SETTINGS.iterations)


def _in_its_place(model: Model, asked: Reduction) -> Iterator[FitResult]:
    """Where fits begin with another effect in the place of this one."""
    base, effect = asked.base, asked.effect
    absent = SimulationColumns(model, base, asked.runs).without(effect)
    products = absent.data.products(np.reshape(absent.change, (-1, 1)))
    explained, _ = gain(products.gram, products.along)
    least = max(SETTINGS.promising, SETTINGS.rival_share * explained)
    neutral = model.candidates[effect].neutral
    for name, candidate in visible(model, base, asked.runs).items():
        plain = [{u.name: u.start for u in candidate.states} for _ in asked.runs]
        score = score_nearby(absent, candidate, plain)
        if score is None or score.gain < least:
            continue
        values, states = absent.values_at(score.theta)
        yield replace(
            base,
            effects=tuple(name if one == effect else one for one in base.effects),
            values={**base.values, **neutral, **values, **score.values},
            states=tuple(
                {**fit, **own, **more}
                for fit, own, more in zip(base.states, states, score.states, strict=True)
            ),
        )
