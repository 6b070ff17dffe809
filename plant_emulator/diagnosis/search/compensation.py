"""Makes room for an effect: the parameter that follows it most is moved to where the cost is least.

Without its cause a fit bends the parameters. One of them may stand for the cause and be bent
further than slopes reach, as a dead time that stands for a filter: a fit with the effect ends
without it then. The simulation is led along the measured outputs, so that contact comes in time
meanwhile.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.approach import CORRECTION_INTERVALS
from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.diagnosis.fitting.signature import signs, values_at_size
from plant_emulator.diagnosis.screening.promise import Start
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.unknowns import column_lengths

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array

    States = Sequence[Mapping[str, float]]


def start_with_room(model: Model, known: FitResult, runs: Sequence[int], base: FitResult) -> Start:
    """The best start of an effect at its begun sizes, with room made for it.

    known : fit with the effect, whose states the start takes
    base : fit without effects along the measured outputs
    """
    (effect,) = known.effects
    observer, candidate = model.observer(CORRECTION_INTERVALS[0]), model.candidates[effect]
    near = linearise(observer, base, runs)
    states = tuple({**own, **fit} for own, fit in zip(known.states, base.states, strict=True))
    found = [
        _moved(observer, effect, runs, near, {**known.values, **base.values, **sizes}, states)
        for sizes in (values_at_size(candidate, one) for one in _begun_sizes(candidate))
    ]
    _, values = min(found, key=lambda one: one[0])
    return Start(values=values, states=states)


def _begun_sizes(candidate: Candidate) -> list[float]:
    """Sizes that are tried: one of either sign where it may have both, or else several."""
    both = len(signs(candidate.sizes)) > 1
    sizes = SETTINGS.begun_sizes[:1] if both else SETTINGS.begun_sizes
    return [sign * size for sign in signs(candidate.sizes) for size in sizes]


def _moved(
    model: Model,
    effect: str,
    runs: Sequence[int],
    near: Estimate,
    values: Mapping[str, float],
    states: States,
) -> tuple[float, dict[str, float]]:
    """Cost where the parameter that follows an effect most is moved, and the values there.

    The parameter stays where no place that was tried costs less.

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
    stays = cost(plain, there)
    if found.fun < stays:
        return float(found.fun), moved(float(found.x))
    return stays, dict(values)
