"""Fits each effect alone, while the slopes of all else follow by secants.

Where the first effect is sought and none of their leaders explains the gap, regressions mislead:
without a cause, a fit has bent the parameters, and the slopes there hardly know the cause. Some
iterations of a fit unbend them. A parameter that stands for the cause may be bent further than
slopes reach, as a dead time that stands for a filter: a search along that parameter unbends it. The
simulation is led along the measured outputs, so that contact comes in time meanwhile. The fits are
cheap, because only the slopes of the effect itself are simulated anew (see
`least_squares.estimate`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.approach import CORRECTION_INTERVALS
from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.fitting.signature import signs, values_at_size
from plant_emulator.diagnosis.search.promise import Promise, Start
from plant_emulator.diagnosis.search.screening import OBSERVER, regressions, visible
from plant_emulator.diagnosis.search.settings import SETTINGS
from plant_emulator.estimation.unknowns import column_lengths

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array

# Name of the score in the trace.
SECANTS = "fit by secants"
# Parts of the library that are fitted at once: each needs the slopes of the base once.
PARTS = 2


@dataclass(frozen=True)
class SecantFits:
    """Effects to fit, each alone, from a fit without effects.

    states : of the runs, by effect, where a regression told those that the effect adds
    iterations : at most so many
    """

    base: FitResult
    runs: tuple[int, ...]
    effects: tuple[str, ...]
    states: Mapping[str, Sequence[Mapping[str, float]]]
    iterations: int


def fitted_promises(runner: TaskRunner, base: FitResult) -> list[Promise]:
    """Gains of effects over the fit without any, each fitted by secants, the largest first.

    All effects are fitted for some iterations, and the best for more.

    base : the fit without effects along the measured outputs
    """
    fitted: list[Promise] = []
    library = visible(runner.model, base, runner.runs)
    names, with_states = tuple(library), [n for n, c in library.items() if c.states]
    found = regressions(runner, base, with_states, (OBSERVER,))
    states = {p.effect: p.starts[OBSERVER].states for p in found if p.starts}
    for iterations in SETTINGS.secant_iterations:
        parts = [
            SecantFits(base, runner.runs, names[k::PARTS], states, iterations)
            for k in range(min(PARTS, len(names)))
        ]
        fitted = [one for part in runner.map(fit_by_secants, parts) for one in part]
        fitted.sort(key=lambda p: -p.gain)
        names = tuple(p.effect for p in fitted[: SETTINGS.tried_further])
    return fitted


def fit_by_secants(model: Model, asked: SecantFits) -> list[Promise]:
    """Gain of each of these effects after some iterations of its fit (a step)."""
    model = model.observer(CORRECTION_INTERVALS[0])
    near = linearise(model, asked.base, asked.runs)
    return [_promise(model, asked, name, near) for name in asked.effects]


def _promise(model: Model, asked: SecantFits, name: str, near: Estimate) -> Promise:
    """The gain of an effect from the best of its starts, and where that fit has come to."""
    base, candidate = asked.base, model.candidates[name]
    own = [u.name for u in candidate.states]
    states = [
        {**fitted, **{state: told[state] for state in own if state in told}}
        for fitted, told in zip(base.states, asked.states.get(name, base.states), strict=True)
    ]
    sized = [{**base.values, **values_at_size(candidate, size)} for size in _sizes(candidate)]
    starts = [_unbent(model, name, asked.runs, near, one, states) for one in sized]
    found = min(
        (
            fit(
                model,
                (name,),
                asked.runs,
                values,
                states,
                asked.iterations,
                near,
            )
            for values in starts
        ),
        key=lambda one: one.cost,
    )
    start = Start(values=found.values, states=found.states)
    gain = 0.5 * (base.cost - found.cost)
    return Promise(effect=name, gains={SECANTS: gain}, starts={SECANTS: start})


def _unbent(
    model: Model,
    name: str,
    runs: Sequence[int],
    near: Estimate,
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> dict[str, float]:
    """The values beside an effect with the parameter that follows it most at its least squares.

    They stay as they are where the search finds nothing better.

    near : slopes at the parameters without the effect; values, states : with the effect
    """
    from scipy.optimize import minimize_scalar

    def rows(found: Mapping[str, float]) -> list[Array]:
        pairs = zip(runs, states, strict=True)
        return [model.residual(k, (name,))({**found, **own}) for k, own in pairs]

    along = np.sum(
        [
            np.einsum("cnj,cn->j", slopes, now - then)
            for slopes, now, then in zip(near.jacobians, rows(values), near.residuals, strict=True)
        ],
        axis=0,
    )
    lengths = column_lengths(near.jacobians)
    shared = np.array([u.run is None for u in near.unknowns])
    j = int(np.argmax(np.where(shared, np.abs(along) / lengths, -1.0)))
    unknown = near.unknowns[j]

    def moved(to: float) -> dict[str, float]:
        return {**values, unknown.name: unknown.value(to)}

    def squares(to: float) -> float:
        return sum(float(np.sum(r**2)) for r in rows(moved(to)))

    bounds = (unknown.scaled(unknown.lower), unknown.scaled(unknown.upper))
    most = SETTINGS.unbending_iterations
    found = minimize_scalar(squares, bounds=bounds, method="bounded", options={"maxiter": most})
    there = float(near.z[j])
    return moved(float(found.x if found.fun < squares(there) else there))


def _sizes(candidate: Candidate) -> tuple[float, ...]:
    """Sizes to begin at; a size that may have either sign finds its own by crossing neutral."""
    two_sided = len(signs(candidate.sizes)) > 1
    return SETTINGS.secant_sizes[:1] if two_sided else SETTINGS.secant_sizes
