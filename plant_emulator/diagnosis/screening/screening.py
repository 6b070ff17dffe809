"""Screens the effects: the gain of log evidence that each promises on top of a fit.

A linear regression predicts it, or a short fit where a state multiplies the size, in the relations
and in the simulation's residual. What is local is clean in the first; what is slow and faint adds
up in the second. A large gap bends the parameters of the fit without effects, some up to their
bounds, and contact comes at the wrong time in its simulation. The relations are those at the
nominal parameters then, and the simulation is led along the measured outputs. Beside effects that
leave a gap the relations are both: the fit may be near the truth, or bent as well. A sagging
voltage beside a lag promised nothing at parameters that had made its limit inactive, and 85 000 at
the nominal ones. On top of effects that leave noise the simulation is right, and tells all that the
relations tell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.approach import CORRECTION_INTERVALS
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.fitting.signature import signs, values_at_size
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.screening.columns import best_score, faint_score, onset_score
from plant_emulator.diagnosis.screening.promise import Promise, Start
from plant_emulator.diagnosis.screening.scans import start_states
from plant_emulator.diagnosis.screening.simulation_columns import SimulationColumns
from plant_emulator.diagnosis.screening.visibility import visible
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fidelity import Fidelity
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.diagnosis.screening.columns import Score, States


# The residuals of a regression, and its name in the trace.
RELATIONS, SIMULATION, OBSERVER = "relations", "simulation", "observer"
NOMINAL_RELATIONS = "relations at nominal parameters"


@dataclass(frozen=True)
class Screening:
    """A screening of effects on top of one fit, by one regression.

    fidelity : residuals of the regression; states : of each effect in each run, by effect
    """

    base: FitResult
    runs: tuple[int, ...]
    effects: tuple[str, ...]
    fidelity: str
    states: Mapping[str, Sequence[Mapping[str, float]]]


def promises(runner: TaskRunner, base: FitResult, led: FitResult | None) -> list[Promise]:
    """Predicted gains of all effects on top of a fit, the largest first.

    led : the fit along the measured outputs, if the base is far from the data
    """
    effects = tuple(visible(runner.model, base, runner.runs))
    if led is not None:
        beside = (RELATIONS,) if base.effects else ()
        return regressions(runner, led, effects, (*beside, NOMINAL_RELATIONS, OBSERVER))
    if _leaves_noise(base):
        return regressions(runner, base, effects, (SIMULATION,))
    nominal = (NOMINAL_RELATIONS,) if base.effects else ()
    return regressions(runner, base, effects, (RELATIONS, *nominal, SIMULATION))


def regressions(
    runner: TaskRunner, base: FitResult, effects: Sequence[str], fidelities: Sequence[str]
) -> list[Promise]:
    """Predicted gains of these effects on top of a fit, the largest first, by these regressions."""
    alone = [
        (Task(base=base.of_runs([k]), runs=(run,)), tuple(effects))
        for k, run in enumerate(runner.runs)
    ]
    of_runs = list(runner.map(start_states, alone))
    states = {name: [own[name] for own in of_runs] for name in of_runs[0]}
    asked = [
        Screening(base, runner.runs, tuple(effects), fidelity, states) for fidelity in fidelities
    ]
    found: dict[str, Promise] = {}
    for one in (one for some in runner.map(screen, asked) for one in some):
        known = found.get(one.effect, Promise(effect=one.effect, gains={}, starts={}))
        found[one.effect] = Promise(
            effect=one.effect,
            gains={**known.gains, **one.gains},
            starts={**known.starts, **one.starts},
        )
    return sorted(found.values(), key=lambda p: -p.gain)


def screen(model: Model, asked: Screening) -> list[Promise]:
    """Predicted gains of effects by one regression, or by short fits beside it (a step)."""
    from threadpoolctl import threadpool_limits

    base, library = asked.base, {name: model.candidates[name] for name in asked.effects}
    if asked.fidelity == NOMINAL_RELATIONS:
        base = _at_nominal(model, asked)
    with threadpool_limits(1):
        fidelity = _fidelity(model, replace(asked, base=base))
        if fidelity is None:
            return []
        found = _scores(library, fidelity, asked)
        promises = {
            name: Promise(
                effect=name,
                gains={asked.fidelity: 0.0 if score is None else score.gain},
                starts={} if score is None else {asked.fidelity: _start(fidelity, score, base)},
            )
            for name, score in found.items()
        }
        if isinstance(fidelity, SimulationColumns):
            scaled = {n: c for n, c in library.items() if any(u.plain for u in c.states)}
            for name, candidate in scaled.items():
                fitted = _fitted(fidelity, candidate, asked)
                promises[name] = max(promises[name], fitted, key=lambda p: p.gain)
        return list(promises.values())


def _fitted(fidelity: SimulationColumns, candidate: Candidate, asked: Screening) -> Promise:
    """The gain of an effect whose states scale with its size, by a short fit.

    At the start of such a state no slope shows what it does to the size, nor what the size does to
    it. All else follows by secants, so that the fit is short.
    """
    states = [
        {**known, **own}
        for known, own in zip(asked.base.states, asked.states[candidate.name], strict=True)
    ]
    found = min(
        (
            fit(
                fidelity.model,
                (*asked.base.effects, candidate.name),
                asked.runs,
                {**asked.base.values, **values_at_size(candidate, way * SETTINGS.sizes[1])},
                states,
                SETTINGS.iterations,
                fidelity.found,
            )
            for way in signs(candidate.sizes)
        ),
        key=lambda one: one.cost,
    )
    return Promise(
        effect=candidate.name,
        gains={asked.fidelity: 0.5 * (asked.base.cost - found.cost)},
        starts={asked.fidelity: Start(values=found.values, states=found.states)},
    )


def _at_nominal(model: Model, asked: Screening) -> FitResult:
    """The base of a screening with the nominal parameters, and the states that suit them.

    The states of its effects stay, as their sizes do.
    """
    base = asked.base
    values = {**base.values, **model.nominal(asked.runs)}
    own = {u.name for effect in base.effects for u in model.candidates[effect].states}
    states = tuple(
        {
            **model.initial_states(k, base.effects, values),
            **{name: value for name, value in fitted.items() if name in own},
        }
        for k, fitted in zip(asked.runs, base.states, strict=True)
    )
    return replace(base, values=values, states=states)


def _fidelity(model: Model, asked: Screening) -> Fidelity | None:
    """The residuals and tangents that a screening asks for; None: the fit cannot be simulated."""
    if asked.fidelity in {RELATIONS, NOMINAL_RELATIONS}:
        return model.relations(asked.base, asked.runs)
    if asked.fidelity == OBSERVER:
        observer = model.observer(CORRECTION_INTERVALS[0])
        return SimulationColumns(observer, asked.base, asked.runs)
    return SimulationColumns(model, asked.base, asked.runs)


def _leaves_noise(base: FitResult) -> bool:
    """Whether a fit with effects leaves nothing but noise."""
    return bool(base.effects) and base.mean_square <= NOISE_MEAN_SQUARE


def _scores(
    library: Mapping[str, Candidate], fidelity: Fidelity, asked: Screening
) -> dict[str, Score | None]:
    """Scores of all effects as if they were faint, and of the best effects at the other sizes.

    An effect that has none there may be a limit; see `onset_score`. On top of effects that leave
    noise another one is faint.
    """
    first, *others = SETTINGS.sizes
    found = {
        name: _first_score(fidelity, candidate, asked.states[name])
        for name, candidate in library.items()
    }
    if asked.fidelity == SIMULATION and _leaves_noise(asked.base):
        return found
    silent = [name for name, score in found.items() if score is None]
    shown = [name for name, score in found.items() if score is not None]
    order = sorted(shown, key=lambda name: -_gain(found[name]))
    for name in order[: SETTINGS.tried_further]:
        more = best_score(fidelity, library[name], others, asked.states[name])
        found[name] = max((found[name], more), key=_gain)
    for name in silent:
        states = asked.states[name]
        found[name] = onset_score(fidelity, library[name], first, max(SETTINGS.sizes), states)
    return found


def _first_score(fidelity: Fidelity, candidate: Candidate, states: States) -> Score | None:
    """Score of an effect at the first size; in a simulation that of its slopes, if it is larger.

    Relations hold between samples: nothing adds up in them, and their columns hardly bend. A
    simulation bends: a contact falls on another sample at the first size, and a law may have
    another slope where it is absent, as friction that gives way before it slides.
    """
    column = best_score(fidelity, candidate, SETTINGS.sizes[:1], states)
    if not isinstance(fidelity, SimulationColumns):
        return column
    return max((faint_score(fidelity, candidate, states), column), key=_gain)


def _gain(score: Score | None) -> float:
    return score.gain if score is not None else float("-inf")


def _start(fidelity: Fidelity, score: Score, where: FitResult) -> Start:
    values, states = fidelity.values_at(score.theta)
    return Start(
        values={**where.values, **values, **score.values},
        states=tuple(
            {**fit, **own, **more}
            for fit, own, more in zip(where.states, states, score.states, strict=True)
        ),
    )
