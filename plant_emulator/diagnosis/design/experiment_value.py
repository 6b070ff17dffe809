"""What a planned run would add to the logs at hand.

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
from plant_emulator.diagnosis.fitting.looks import FEW_WITH_STATES
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.fitting.signature import bounded, signs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.execution.pool import Recipe
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model


@dataclass(frozen=True)
class PlannedRecipe:
    """What builds the machine of a recipe with the runs that it has not shown yet.

    where : the fit to `runs` that foretells them
    """

    recipe: Recipe
    where: FitResult
    runs: tuple[int, ...]

    def build(self) -> Model:
        """The extended machine."""
        return self.recipe.build().with_planned_runs(self.where, self.runs)

    def digest(self) -> str:
        """The same for the same machine, fit and runs only."""
        fitted = repr((self.where.key, self.runs))
        return f"{self.recipe.digest()}+{hashlib.sha256(fitted.encode()).hexdigest()}"


@dataclass(frozen=True, kw_only=True)
class Asked:
    """A question to one planned run.

    where : a fit to `runs`: of a rival, or without effects; names : of the effects asked about
    """

    where: FitResult
    runs: tuple[int, ...]
    planned: int
    names: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Exchange:
    """An accepted effect exchanged for another one, the rest as accepted, on these runs."""

    final: FitResult
    name: str
    other: str
    alone: FitResult | None
    runs: tuple[int, ...]


def rival(model: Model, asked: Exchange) -> FitResult:
    """Step: the fit with one effect in the place of another.

    That of the contest where the other effect is the only one.
    """
    effects = (*(e for e in asked.final.effects if e != asked.name), asked.other)
    if asked.alone is not None and asked.alone.effects == effects:
        return asked.alone
    known = {} if asked.alone is None else dict(asked.alone.values)
    values = {**known, **asked.final.values}
    return fit(model, effects, asked.runs, values, asked.final.states, FEW_WITH_STATES)


def apart(model: Model, asked: Asked) -> float:
    """Step: what of a planned run the rival cannot follow, norm in the noise."""
    own = model.initial_states(asked.planned, asked.where.effects, asked.where.values)
    where = replace(asked.where, states=(*asked.where.states, own))
    ahead = model.residual(asked.planned, where.effects)({**where.values, **own})
    raw = float(np.linalg.norm(ahead))
    if raw < DETECTABLE_NORM:
        return raw
    runs = (*asked.runs, asked.planned)
    found = fit(model, where.effects, runs, where.values, where.states, FEW_WITH_STATES)
    return min(
        raw, sqrt(max(0.0, found.cost - found.occam_penalty - where.cost + where.occam_penalty))
    )


def seen(model: Model, asked: Asked) -> dict[str, float]:
    """Step: norm of the drift-free signature of effects at their plausible size, by name."""
    where, runs = _as_foretold(asked)
    tangents = NuisanceSpace(linearise(model, where, runs))
    return {name: _signature_norm(model, name, where, runs, tangents) for name in asked.names}


def informs(model: Model, asked: Asked) -> float:
    """Step: logarithm of how sharply a planned run determines, with these, all that drifts."""
    found = linearise(model, *_as_foretold(asked))
    precision = np.diag([u.scaled_std**-2.0 for u in found.unknowns])
    return float(np.linalg.slogdet(found.information + precision).logabsdet)


def _as_foretold(asked: Asked) -> tuple[FitResult, tuple[int, ...]]:
    """The fit and its runs with the planned one, which starts as the last one did."""
    where = asked.where
    return replace(where, states=(*where.states, where.states[-1])), (*asked.runs, asked.planned)


def _signature_norm(
    model: Model, name: str, where: FitResult, runs: Sequence[int], tangents: NuisanceSpace
) -> float:
    """Norm of the part of an effect's signature that drift cannot imitate, the larger sign."""
    candidate = model.candidates[name]
    own = {u.name: u.start for u in (*candidate.states, *candidate.shapes)}
    norms = []
    for sign in signs(candidate.sizes):
        sizes = {u.name: bounded(u, candidate.neutral[u.name], sign) for u in candidate.sizes}
        rows = [
            model.residual(k, (*where.effects, name))({**where.values, **state, **own, **sizes})
            for k, state in zip(runs, where.states, strict=True)
        ]
        change = np.concatenate([row.ravel() for row in rows]) - tangents.residual
        norms.append(float(np.linalg.norm(tangents.orthogonal(change))))
    return max(norms)
