"""What an effect gains beside other forms of the laws of the other effects.

An approximate law may depend otherwise on the speed and on the load (`simulation.law_forms`). A
further effect that only follows what such a law leaves gains little where the law may bend. At a
fit, the coefficients of the forms are unknowns with a prior: the relative error of a law. Least
squares then give the sizes s of the effect, their distance from neutral d and covariance C beside
the forms and all other unknowns, and the effect gains

    0.5 d' C^-1 d

C is enlarged by what is left, and by its autocorrelation. A size on the other side of neutral is
another effect: its distance counts as 0.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.diagnosis.fitting.relaxation import relax
from plant_emulator.diagnosis.search.settings import SETTINGS
from plant_emulator.estimation.unknowns import Unknown

if TYPE_CHECKING:
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.confirmation import Reduction


def gain_beside_forms(model: Model, asked: Reduction) -> float:
    """Gain of log evidence of an effect of a fit beside those forms (a step).

    It is infinite where no law of the others has another form.
    """
    base, candidate = asked.base, model.candidates[asked.effect]
    others = [model.candidates[name] for name in base.effects if name != asked.effect]
    forms = [_coefficient(name) for one in others for name in one.forms]
    if not forms:
        return inf
    near = linearise(model, base, asked.runs, forms)
    beside = relax(near)
    names = [u.name for u in near.unknowns]
    at = [names.index(u.name) for u in candidate.sizes]
    neutral = np.array([u.scaled(candidate.neutral[u.name]) for u in candidate.sizes])
    fitted = near.z[at] - neutral
    distance = fitted + beside.change[at]
    distance = np.where(distance * fitted > 0.0, distance, 0.0)
    covariance = beside.inflation * beside.covariance[np.ix_(at, at)]
    return 0.5 * float(distance @ np.linalg.pinv(covariance, hermitian=True) @ distance)


def _coefficient(name: str) -> Unknown:
    """The relative error of a law in one of its other forms."""
    return Unknown(
        name=name,
        start=0.0,
        lower=-1.0,
        upper=1.0,
        logarithmic=False,
        scale=SETTINGS.law_error,
        std=SETTINGS.law_error,
    )
