"""Effects in the terms that the field knows them by, with standard errors (pure)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.diagnosis.answer import Quantity
from plant_emulator.diagnosis.fitting.joint_fit import linearise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import DerivedQuantity, Model
    from plant_emulator.estimation.unknowns import Estimate

# Half step of a central difference on the scale of the estimation.
STEP = 1e-4


def in_terms(
    model: Model, found: FitResult, runs: Sequence[int]
) -> dict[str, tuple[Quantity, ...]]:
    """By effect of a fit: its terms.

    The variance of a term t is g' C g, C the covariance of the fit and g the slope of t by it
    (propagation of errors: JCGM 100:2008, eq. 13).
    """
    named = {name: model.candidates[name].derived for name in found.effects}
    if not any(named.values()):
        return {}
    where = linearise(model, found, runs)
    return {name: tuple(_quantity(term, where) for term in terms) for name, terms in named.items()}


def _quantity(term: DerivedQuantity, where: Estimate) -> Quantity:
    shared = [k for k, u in enumerate(where.unknowns) if u.run is None]
    slope = np.zeros(len(where.z))
    for k in shared:
        step = STEP * np.eye(len(where.z))[k]
        slope[k] = (_at(term, where, step) - _at(term, where, -step)) / (2.0 * STEP)
    on = np.flatnonzero(slope)  # an unknown that the term is not of may have an infinite variance
    return Quantity(
        name=term.name,
        value=_at(term, where, np.zeros(len(where.z))),
        standard_error=float(np.sqrt(slope[on] @ where.covariance[np.ix_(on, on)] @ slope[on])),
        unit=term.unit,
    )


def _at(
    term: DerivedQuantity, where: Estimate, step: np.ndarray[Any, np.dtype[np.float64]]
) -> float:
    pairs = zip(where.unknowns, where.z + step, strict=True)
    return term.of({u.name: u.value(float(z)) for u, z in pairs if u.run is None})
