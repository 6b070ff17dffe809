"""The information that a planned run would add to the logs at hand.

The machine simulates planned runs at a fit to its logs (`Model.with_planned_runs`).

Discriminability of two hypotheses: the alternative is fitted again, with all its parameters, to
the logs and to the planned run as the accepted hypothesis simulates it. What it cannot follow is

    sqrt(rise of the alternative's cost)   [1], in the noise

A linear prediction does not do. The spikes of a backlash move with every parameter, so that two
hypotheses seem far apart that a fit brings together.

Visibility of an absent effect: the norm of its orthogonal signature over the logs and the planned
run together, as in `detectability`.

Information gain of a run: the log determinant of the information matrix (D-optimality;
A. Atkinson, A. Donev, Optimum Experimental Designs, 1992).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.evidence import DETECTABLE_NORM
from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.fitting.signature import bounded_size, signs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.execution.pool import Recipe
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model


# Iterations of the fit of an alternative: it only has to show what the alternative can follow.
ALTERNATIVE_ITERATIONS = 24


@dataclass(frozen=True)
class PlannedRecipe:
    """The recipe of a machine with planned runs behind its own.

    fitted : fit to `runs` at which the planned runs are simulated
    """

    recipe: Recipe
    fitted: FitResult
    runs: tuple[int, ...]

    def build(self) -> Model:
        """Build the extended machine."""
        return self.recipe.build().with_planned_runs(self.fitted, self.runs)

    def digest(self) -> str:
        """Hash of the machine's recipe, the fit and the runs."""
        own = repr((self.fitted.key, self.runs))
        return f"{self.recipe.digest()}+{hashlib.sha256(own.encode()).hexdigest()}"


@dataclass(frozen=True, kw_only=True)
class PlannedRun:
    """A planned run, and the fit that it is judged by.

    planned : number of the planned run
    fitted : fit to `runs`, of an alternative or without effects
    effects : names of the effects that are looked for
    """

    fitted: FitResult
    runs: tuple[int, ...]
    planned: int
    effects: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Alternative:
    """The hypothesis with another effect in the place of an accepted one.

    final : fit with the accepted effects to `runs`
    name : of the effect that is replaced; other : of the effect in its place
    alone : fit with the other effect alone; None: there is none
    """

    final: FitResult
    name: str
    other: str
    alone: FitResult | None
    runs: tuple[int, ...]


def fit_alternative(model: Model, asked: Alternative) -> FitResult:
    """Fit an alternative (a step); a fit with the other effect alone is not made again."""
    effects = (*(e for e in asked.final.effects if e != asked.name), asked.other)
    if asked.alone is not None and asked.alone.effects == effects:
        return asked.alone
    known = {} if asked.alone is None else dict(asked.alone.values)
    values = {**known, **asked.final.values}
    return fit(model, effects, asked.runs, values, asked.final.states, ALTERNATIVE_ITERATIONS)


def discriminability(model: Model, asked: PlannedRun) -> float:
    """Norm of the part of a planned run that the alternative cannot reproduce [deviations]."""
    alternative = asked.fitted
    own = model.initial_states(asked.planned, alternative.effects, alternative.values)
    ahead = model.residual(asked.planned, alternative.effects)({**alternative.values, **own})
    unfitted = float(np.linalg.norm(ahead))
    if unfitted < DETECTABLE_NORM:
        return unfitted
    found = fit(
        model,
        alternative.effects,
        (*asked.runs, asked.planned),
        alternative.values,
        (*alternative.states, own),
        ALTERNATIVE_ITERATIONS,
    )
    rise = found.cost - found.occam_penalty - alternative.cost + alternative.occam_penalty
    return min(unfitted, sqrt(max(0.0, rise)))


def visibility(model: Model, asked: PlannedRun) -> dict[str, float]:
    """Norm of each effect's orthogonal signature with a planned run, in the noise [1] (a step)."""
    fitted, runs = _with_planned_run(asked)
    nuisance = NuisanceSpace(linearise(model, fitted, runs))
    return {name: _signature_norm(model, name, fitted, runs, nuisance) for name in asked.effects}


def information_gain(model: Model, asked: PlannedRun) -> float:
    """Log determinant of the information with a planned run and the priors [1] (a step)."""
    found = linearise(model, *_with_planned_run(asked))
    precision = np.diag([u.scaled_std**-2.0 for u in found.unknowns])
    return float(np.linalg.slogdet(found.information + precision).logabsdet)


def _with_planned_run(asked: PlannedRun) -> tuple[FitResult, tuple[int, ...]]:
    """The fit and its runs with the planned run, which starts as the last run did."""
    states = (*asked.fitted.states, asked.fitted.states[-1])
    return replace(asked.fitted, states=states), (*asked.runs, asked.planned)


def _signature_norm(
    model: Model, name: str, fitted: FitResult, runs: Sequence[int], nuisance: NuisanceSpace
) -> float:
    """Norm of an effect's orthogonal signature at its plausible size, of the larger sign."""
    candidate = model.candidates[name]
    own = {u.name: u.start for u in (*candidate.states, *candidate.shapes)}
    norms = []
    for sign in signs(candidate.sizes):
        sizes = {u.name: bounded_size(u, candidate.neutral[u.name], sign) for u in candidate.sizes}
        rows = [
            model.residual(k, (*fitted.effects, name))({**fitted.values, **state, **own, **sizes})
            for k, state in zip(runs, fitted.states, strict=True)
        ]
        change = np.concatenate([row.ravel() for row in rows]) - nuisance.residual
        norms.append(float(np.linalg.norm(nuisance.orthogonal(change))))
    return max(norms)
