"""Fits each effect alone, while the slopes of all else follow by secants.

Where the first effect is sought and none of their leaders explains the gap, regressions mislead:
without a cause, a fit has bent the parameters, and the slopes there hardly know the cause. Some
iterations of a fit unbend them, from where one of them has made room (`compensation`). The
simulation is led along the measured outputs, so that contact comes in time meanwhile. The fits are
cheap, because only the slopes of the effect itself are simulated anew (see
`least_squares.estimate`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.approach import CORRECTION_INTERVALS
from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.screening.compensation import PARTS, begun_sizes, compensated
from plant_emulator.diagnosis.screening.promise import Promise, Start
from plant_emulator.diagnosis.screening.screening import OBSERVER, regressions
from plant_emulator.diagnosis.screening.visibility import visible
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.estimation.unknowns import Estimate

# Name of the score in the trace.
SECANTS = "fit by secants"


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
    sized = [{**base.values, **values_at_size(candidate, size)} for size in begun_sizes(candidate)]
    starts = [compensated(model, name, asked.runs, near, one, states)[1] for one in sized]
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
