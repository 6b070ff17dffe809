"""What other forms of the laws of the other effects leave of an effect: its gain, and its sizes.

An approximate law may depend otherwise on the speed and on the load (`simulation.law_forms`). A
further effect that only follows what such a law leaves gains little where the law may bend. At a
fit, the coefficients of the forms are unknowns with a prior: the relative error of a law. Least
squares then give the sizes s of the effect, their distance from neutral d and covariance C beside
the forms and all other unknowns, and the effect gains

    0.5 d' C^-1 d

C is enlarged by what is left, and by its autocorrelation. A size on the other side of neutral is
another effect: its distance counts as 0.

A value of the fit is off by what the other laws are off by, and no residual shows it. Its standard
error is the root of its variance in C and of the square of its change, each beside the forms.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.diagnosis.fitting.relaxation import relax
from plant_emulator.diagnosis.search.settings import SETTINGS
from plant_emulator.estimation.unknowns import Unknown

if TYPE_CHECKING:
    from collections.abc import Container

    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.confirmation import Reduction
    from plant_emulator.estimation.unknowns import Estimate


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


def errors_beside_forms(model: Model, task: Task) -> dict[str, float]:
    """Standard errors of the values of a fit beside other forms of the laws, by name (a step).

    A size or a shape is asked beside the forms of the other effects, a parameter beside all forms.
    A value beside which no law has another form keeps its error.
    """
    base = task.base
    errors = dict(base.standard_errors)
    own = [model.candidates[name] for name in base.effects]
    near = linearise(model, base, task.runs, [_coefficient(f) for one in own for f in one.forms])
    groups = [({u.name for u in (*one.sizes, *one.shapes)}, one.forms) for one in own]
    for names, left_out in [*groups, ({u.name for u in model.parameters}, ())]:
        if all(set(one.forms) <= set(left_out) for one in own):
            continue
        asked = _without(near, left_out)
        beside = relax(asked)
        variances = beside.inflation * np.diag(beside.covariance) + beside.change**2
        for u, z, variance in zip(asked.unknowns, asked.z, variances, strict=True):
            if u.name in names:
                errors[u.name] = u.error(u.value(float(z)), float(np.sqrt(variance)))
    return errors


def _without(near: Estimate, names: Container[str]) -> Estimate:
    """The least squares without these unknowns."""
    kept = [k for k, u in enumerate(near.unknowns) if u.name not in names]
    return replace(
        near,
        unknowns=tuple(near.unknowns[k] for k in kept),
        z=near.z[kept],
        jacobians=tuple(slopes[..., kept] for slopes in near.jacobians),
    )


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
