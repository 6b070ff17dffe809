"""What other forms of the laws of the other effects leave of an effect: its gain, and its sizes.

An approximate law may depend otherwise on the speed and on the load (`simulation.law_forms`). A
further effect that only follows what such a law leaves gains little where the law may bend. At a
fit, the coefficients of the forms are unknowns with a prior: the relative error of a law. Least
squares then give the sizes s of the effect, their distance from neutral d and covariance C beside
the forms and all other unknowns, and the effect gains

    0.5 d' C^-1 d

C is enlarged by what is left, and by its autocorrelation. A size on the other side of neutral is
another effect: its distance counts as 0.

A value of a fit is off by what the other laws are off by, and no residual shows that. Where the
values follow the coefficients as B c, and these are c with covariance K, the variance of the value
grows by its part of

    B (K + c c') B'

"""

from __future__ import annotations

from math import hypot, inf
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.diagnosis.fitting.relaxation import normal_equations, relax
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.unknowns import Unknown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.confirmation import Reduction
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array

# Share of the distance of its bounds within which an unknown is at one: a fit starts a hundredth of
# that from a bound, and may stay there.
BOUND_MARGIN = 1e-4


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
    None is less than that of the fit.
    """
    errors = dict(task.base.standard_errors)
    own = [model.candidates[name] for name in task.base.effects]
    forms = [form for one in own for form in one.forms]
    if not forms:
        return errors
    near = linearise(model, task.base, task.runs, [_coefficient(name) for name in forms])
    groups = [({u.name for u in (*one.sizes, *one.shapes)}, one.forms) for one in own]
    for names, left_out in [*groups, ({u.name for u in model.parameters}, ())]:
        rise = _rise_beside(near, len(forms), [name not in left_out for name in forms])
        for u, z, variance in zip(near.unknowns[: -len(forms)], near.z, rise, strict=False):
            if u.name in names:
                more = u.error(u.value(float(z)), float(np.sqrt(variance)))
                errors[u.name] = hypot(errors[u.name], more)
    return errors


def _rise_beside(near: Estimate, forms: int, asked: Sequence[bool]) -> Array:
    """Rise of the variances of fitted unknowns beside some forms, on the scale of the estimation.

    forms : number of coefficients, the last unknowns; asked : which of them are free
    What is left of the gradient at a fit is that of contact, which is not smooth. What the fitted
    unknowns would follow does not move the coefficients, and counts as no change. An unknown that
    its bound stops follows nothing.
    """
    curvature, gradient = normal_equations(near)
    free = len(near.z) - forms + np.flatnonzero(asked)
    fitted = np.flatnonzero(~_stopped(near, gradient)[:-forms])
    cross = curvature[np.ix_(fitted, free)]
    scale = np.sqrt(np.diag(curvature)[fitted])
    scale = np.where(scale > 0.0, scale, 1.0)[:, None]
    own = curvature[np.ix_(fitted, fitted)] / (scale * scale.T)
    # An unknown that no sample shows has no curvature, and follows nothing.
    follows, *_ = np.linalg.lstsq(own, -cross / scale)
    follows /= scale
    covariance = np.linalg.inv(curvature[np.ix_(free, free)] + cross.T @ follows)
    change = covariance @ (gradient[free] + gradient[fitted] @ follows)
    spread = covariance + np.outer(change, change)
    rise = np.zeros(len(near.z) - forms)
    rise[fitted] = np.einsum("ij,jk,ik->i", follows, spread, follows)
    return rise


def _stopped(near: Estimate, gradient: Array) -> NDArray[np.bool_]:
    """Unknowns at a bound beyond which the sum of squares falls, shape (unknowns,).

    All bounds are finite.
    """
    lower = np.array([u.scaled(u.lower) for u in near.unknowns])
    upper = np.array([u.scaled(u.upper) for u in near.unknowns])
    margin = BOUND_MARGIN * (upper - lower)
    at_lower, at_upper = near.z <= lower + margin, near.z >= upper - margin
    return np.asarray((at_lower & (gradient > 0.0)) | (at_upper & (gradient < 0.0)))


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
