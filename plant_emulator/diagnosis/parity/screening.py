"""Which effects are worth a fit: the gain of log evidence that their columns promise.

Each effect has two scores on top of a fit, in the relations and in the simulation's residual. What
is local is clean in the first; what is slow and faint adds up in the second. The larger counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.parity.columns import best_score
from plant_emulator.diagnosis.parity.settings import SETTINGS
from plant_emulator.diagnosis.parity.simulation_columns import SimulationColumns
from plant_emulator.estimation.robust_scan import scan_unknowns

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fidelity import Fidelity
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.diagnosis.parity.columns import Score
    from plant_emulator.estimation.unknowns import Residual, Unknown

    # By effect and by fidelity.
    Scores = dict[str, dict[str, "Score | None"]]


@dataclass(frozen=True, kw_only=True)
class Start:
    """Where a joint fit may begin: values by name, and the states of each run."""

    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]


@dataclass(frozen=True, kw_only=True)
class Promise:
    """What an effect promises on top of a fit; gains : of log evidence by fidelity."""

    effect: str
    gains: Mapping[str, float]
    starts: tuple[Start, ...]

    @property
    def gain(self) -> float:
        """The larger score."""
        return max(self.gains.values(), default=0.0)


@dataclass(frozen=True, kw_only=True)
class Visibility:
    """How far a fit shows an effect at its plausible size.

    total_norm : of the change of the simulation's residual
    orthogonal_norm : of the part that no nuisance parameter can follow
    confounded_with : nuisance parameter that follows the change most
    """

    orthogonal_norm: float = 0.0
    total_norm: float = 0.0
    confounded_with: str = ""


def visibilities(model: Model, task: Task) -> dict[str, Visibility]:
    """How far the fit `task.base` shows each effect of the library (a step)."""
    simulation = SimulationColumns(model, task.base, task.runs)
    return {
        name: Visibility() if one.stochastic else _visibility(simulation, one)
        for name, one in model.candidates.items()
    }


def _visibility(simulation: SimulationColumns, candidate: Candidate) -> Visibility:
    states = [{u.name: u.start for u in candidate.states} for _ in simulation.runs]
    column = simulation.column(candidate.name, values_at_size(candidate, 1.0), states)
    if column is None or not column.any():
        return Visibility()
    square = float(simulation.data.gram(column[:, None])[0, 0])
    return Visibility(
        orthogonal_norm=float(np.sqrt(max(0.0, square))),
        total_norm=float(np.linalg.norm(column)),
        confounded_with=simulation.confounded_with(column),
    )


def screen(model: Model, task: Task) -> list[Promise]:
    """Promises of all effects on top of the fit `task.base`, the largest first (a step).

    On top of a fit with effects that leaves noise, another effect is tried at one size only.
    """
    from threadpoolctl import threadpool_limits

    last = bool(task.base.effects) and task.base.mean_square <= NOISE_MEAN_SQUARE
    sizes = (1.0,) if last else SETTINGS.sizes
    with threadpool_limits(1):
        return _promises(model, task.base, task.runs, sizes)


def _promises(
    model: Model, where: FitResult, runs: Sequence[int], sizes: Sequence[float]
) -> list[Promise]:
    simulation = SimulationColumns(model, where, runs)
    relations = model.relations(where, runs)
    fidelities: dict[str, Fidelity] = {"simulation": simulation}
    if relations is not None:
        fidelities["relations"] = relations
    library = {
        name: one
        for name, one in model.candidates.items()
        if name not in where.effects and not one.stochastic
    }
    states = {name: start_states(model, one, where, runs) for name, one in library.items()}
    scores = _scores(library, fidelities, sizes, states)
    found = [_promise(name, own, fidelities, where) for name, own in scores.items()]
    return sorted(found, key=lambda p: -p.gain)


def start_states(
    model: Model, candidate: Candidate, where: FitResult, runs: Sequence[int]
) -> list[dict[str, float]]:
    """States of an effect in each run that its columns are taken at.

    A state with many narrow basins, as a frequency, is scanned on top of a fit without effects.
    """
    plain = [{u.name: u.start for u in candidate.states} for _ in runs]
    if where.effects or all(u.step is None for u in candidate.states):
        return plain
    values = {**where.values, **values_at_size(candidate, SETTINGS.sizes[0])}
    return [
        scan_states(model.residual(k, (candidate.name,)), {**values, **fit}, candidate.states, own)
        for k, fit, own in zip(runs, where.states, plain, strict=True)
    ]


def scan_states(
    residual: Residual,
    values: Mapping[str, float],
    states: Sequence[Unknown],
    start: Mapping[str, float],
) -> dict[str, float]:
    """The best of the values of these states, with all else as given."""
    return scan_unknowns(lambda own: residual({**values, **own}), start, states)


def _scores(
    library: Mapping[str, Candidate],
    fidelities: Mapping[str, Fidelity],
    sizes: Sequence[float],
    states: Mapping[str, Sequence[Mapping[str, float]]],
) -> Scores:
    """Scores of all effects at the first size, and of the best effects at the other sizes."""
    found: Scores = {
        name: {
            key: best_score(one, candidate, sizes[:1], states[name])
            for key, one in fidelities.items()
        }
        for name, candidate in library.items()
    }
    if len(sizes) == 1:
        return found
    further = {name for name, own in found.items() if not any(own.values())}
    for key in fidelities:
        order = sorted(found, key=lambda name: -_gain(found[name][key]))
        further.update(order[: SETTINGS.tried_further])
    for name in sorted(further):
        for key, one in fidelities.items():
            more = best_score(one, library[name], sizes[1:], states[name])
            found[name][key] = max((found[name][key], more), key=_gain)
    return found


def _gain(score: Score | None) -> float:
    return score.gain if score is not None else float("-inf")


def _promise(
    name: str,
    scores: Mapping[str, Score | None],
    fidelities: Mapping[str, Fidelity],
    where: FitResult,
) -> Promise:
    there = {key: score for key, score in scores.items() if score is not None}
    return Promise(
        effect=name,
        gains={key: score.gain for key, score in there.items()},
        starts=tuple(_start(fidelities[key], score, where) for key, score in there.items()),
    )


def _start(fidelity: Fidelity, score: Score, where: FitResult) -> Start:
    values, states = fidelity.values_at(score.theta)
    return Start(
        values={**where.values, **values, **score.values},
        states=tuple(
            {**fit, **own, **more}
            for fit, own, more in zip(where.states, states, score.states, strict=True)
        ),
    )
