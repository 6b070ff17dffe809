"""Gains of effects for which one parameter makes room.

Without its cause a fit bends the parameters. One of them may stand for the cause and be bent
further than slopes reach, as a dead time that stands for a filter: regressions around the fit know
nothing of the cause then. Each effect is simulated at a size, and the parameter that follows it
most is moved to where the cost is least. The simulation is led along the measured outputs, so that
contact comes in time meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.approach import CORRECTION_INTERVALS
from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.diagnosis.fitting.signature import signs, values_at_size
from plant_emulator.diagnosis.screening.promise import Promise, Start
from plant_emulator.diagnosis.screening.visibility import visible
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.unknowns import column_lengths

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array

    States = Sequence[Mapping[str, float]]

# Name of the score in the trace.
COMPENSATED = "one parameter moved"
# Parts of the library that are tried at once: each needs the slopes of the base once.
PARTS = 2


@dataclass(frozen=True)
class Compensation:
    """Effects to try, each alone.

    base : fit without effects along the measured outputs
    """

    base: FitResult
    runs: tuple[int, ...]
    effects: tuple[str, ...]


def compensated_promises(runner: TaskRunner, base: FitResult) -> list[Promise]:
    """Gains of all effects over the fit without any, the largest first.

    base : the fit without effects along the measured outputs
    """
    names = tuple(visible(runner.model, base, runner.runs))
    parts = [Compensation(base, runner.runs, names[k::PARTS]) for k in range(PARTS)]
    found = [one for some in runner.map(compensate, parts) for one in some]
    return sorted(found, key=lambda p: -p.gain)


def compensate(model: Model, asked: Compensation) -> list[Promise]:
    """Gain of each of these effects at the best of its sizes, and where that is (a step)."""
    observer = model.observer(CORRECTION_INTERVALS[0])
    near = linearise(observer, asked.base, asked.runs)
    return [_promise(observer, asked, name, near) for name in asked.effects]


def _promise(model: Model, asked: Compensation, name: str, near: Estimate) -> Promise:
    base, candidate = asked.base, model.candidates[name]
    plain = {u.name: u.start for u in candidate.states}
    states = tuple({**plain, **own} for own in base.states)
    found = [
        compensated(model, name, asked.runs, near, {**base.values, **sizes}, states)
        for sizes in (values_at_size(candidate, one) for one in _tried_sizes(candidate))
    ]
    fall, values = max(found, key=lambda one: one[0])
    return Promise(
        effect=name,
        gains={COMPENSATED: 0.5 * fall},
        starts={COMPENSATED: Start(values=values, states=states)},
    )


def begun_sizes(candidate: Candidate) -> tuple[float, ...]:
    """Sizes that a fit begins at; one of either sign finds its own by crossing neutral."""
    two_sided = len(signs(candidate.sizes)) > 1
    return SETTINGS.begun_sizes[:1] if two_sided else SETTINGS.begun_sizes


def _tried_sizes(candidate: Candidate) -> list[float]:
    """Sizes that are tried: of either sign, where it may have both, or several."""
    return [sign * size for sign in signs(candidate.sizes) for size in begun_sizes(candidate)]


def compensated(
    model: Model,
    effect: str,
    runs: Sequence[int],
    near: Estimate,
    values: Mapping[str, float],
    states: States,
) -> tuple[float, dict[str, float]]:
    """Fall of the cost where the parameter that follows an effect most is moved, and the values.

    The fall is negative where no place that was tried leaves less than the fit without the effect.

    near : slopes at the parameters without the effect; values, states : with it
    """
    from scipy.optimize import minimize_scalar

    def rows(found: Mapping[str, float]) -> list[Array]:
        pairs = zip(runs, states, strict=True)
        return [model.residual(k, (effect,))({**found, **own}) for k, own in pairs]

    def moved(to: float) -> dict[str, float]:
        return {**values, unknown.name: unknown.value(to)}

    def cost(rows: Sequence[Array], z: float) -> float:
        found = sum(float(np.vdot(one, one)) for one in rows) + penalty(z)
        return found if np.isfinite(found) else np.inf

    def penalty(z: float) -> float:
        if unknown.std is None:
            return 0.0
        return float(((z - unknown.scaled(unknown.prior)) / unknown.scaled_std) ** 2)

    plain = rows(values)
    change = [one - then for one, then in zip(plain, near.residuals, strict=True)]
    along = sum(np.einsum("cnj,cn->j", *pair) for pair in zip(near.jacobians, change, strict=True))
    shared = np.array([u.run is None for u in near.unknowns])
    follows = np.abs(along) / column_lengths(near.jacobians)
    j = int(np.argmax(np.where(shared, follows, -1.0)))
    unknown, there = near.unknowns[j], float(near.z[j])
    lower, upper = unknown.scaled(unknown.lower), unknown.scaled(unknown.upper)
    reach = SETTINGS.compensating_reach * (upper - lower)
    found = minimize_scalar(
        lambda z: cost(rows(moved(z)), z),
        bounds=(max(lower, there - reach), min(upper, there + reach)),
        method="bounded",
        options={"maxiter": SETTINGS.compensating_iterations},
    )
    without, stays = near.cost + penalty(there), cost(plain, there)
    if found.fun < stays:
        return without - float(found.fun), moved(float(found.x))
    return without - stays, dict(values)
