"""Quantities that the field knows an effect by, with standard errors, from the values of a fit.

The standard error of a quantity t follows by propagation of errors (JCGM 100:2008, eq. 13):

    s_t^2 = g' C g

g : derivative of t by the unknowns; C : covariance of the fit
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import Quantity
from plant_emulator.diagnosis.fitting.joint_fit import linearise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import DerivedQuantity, Model
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array

# Half step of a central difference on the scale of the estimation.
STEP = 1e-4


def derived_quantities(
    model: Model, found: FitResult, runs: Sequence[int]
) -> dict[str, tuple[Quantity, ...]]:
    """Derived quantities of each effect of a fit, by effect; empty where no effect has any."""
    derived = {name: model.candidates[name].derived for name in found.effects}
    if not any(derived.values()):
        return {}
    estimate = linearise(model, found, runs)
    return {name: tuple(_quantity(q, estimate) for q in own) for name, own in derived.items()}


def _quantity(derived: DerivedQuantity, found: Estimate) -> Quantity:
    shared = [k for k, u in enumerate(found.unknowns) if u.run is None]
    slope = np.zeros(len(found.z))
    for k in shared:
        step = STEP * np.eye(len(found.z))[k]
        slope[k] = (_at(derived, found, step) - _at(derived, found, -step)) / (2.0 * STEP)
    on = np.flatnonzero(slope)  # other unknowns may have an infinite variance
    return Quantity(
        name=derived.name,
        value=_at(derived, found, np.zeros(len(found.z))),
        standard_error=float(np.sqrt(slope[on] @ found.covariance[np.ix_(on, on)] @ slope[on])),
        unit=derived.unit,
    )


def _at(derived: DerivedQuantity, found: Estimate, step: Array) -> float:
    """Value of the quantity [unit] a step of z away from the estimate."""
    pairs = zip(found.unknowns, found.z + step, strict=True)
    return derived.formula({u.name: u.value(float(z)) for u, z in pairs if u.run is None})
