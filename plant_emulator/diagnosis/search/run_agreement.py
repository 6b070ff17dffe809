"""Whether the runs agree on the size of an effect.

An effect has one size in all runs. An effect that stands for the error of another one's law follows
what differs from run to run. At a fit, the Jacobian's column of a size s is split into one column a
run: least squares then tell a size of its own for each run, beside all other unknowns. The sizes
s_k, with covariance C, agree where chance leaves their chi squared,

    (s_k - m)' V^-1 (s_k - m),   V = C + (e s)^2 I

m is their weighted mean, e the relative error of a law. It is the test of homogeneity of effect
sizes (W. Cochran, Biometrics 10 (1954) 101). A single run is split into its two halves. An error
that is the same in all runs, as in logs of one program, is not found.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2

from plant_emulator.diagnosis.fitting.joint_fit import (
    SHRINKAGE,
    effective_fraction,
    linearise,
)
from plant_emulator.diagnosis.search.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.confirmation import Reduction
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class RunAgreement:
    """What the runs say of an effect.

    probability : that chance and a law's error make its sizes differ so much between runs [1]
    runs : number of runs that show the effect
    """

    probability: float
    runs: int


@dataclass(frozen=True, kw_only=True)
class _Split:
    """A fit with a size of each run.

    changes : of the size, shape (runs,); covariance : of them, for white residuals of variance 1
    inflation : of that covariance, by what the split fit leaves and its autocorrelation [1]
    """

    changes: Array
    covariance: Array
    inflation: float


def run_agreement(model: Model, asked: Reduction) -> RunAgreement:
    """What the runs say of an effect of a fit, of its size on which they differ most (a step).

    A run that does not show a size has its prior, and counts as none.
    """
    candidate = model.candidates[asked.effect]
    near = linearise(model, asked.base, asked.runs)
    names = [u.name for u in near.unknowns]
    probability, showing = 1.0, 0
    for unknown in candidate.sizes:
        index, neutral = names.index(unknown.name), unknown.scaled(candidate.neutral[unknown.name])
        widest = SHRINKAGE * abs(unknown.scaled(unknown.start) - neutral)
        split = _split(near, index, widest)
        runs = round(float(np.sum(1.0 - np.diag(split.covariance) / widest**2)))
        law = SETTINGS.law_error * (float(near.z[index]) - neutral)
        spread = _spread(
            split.changes, split.inflation * split.covariance + law**2 * np.eye(len(split.changes))
        )
        probability = min(probability, float(chi2.sf(spread, max(1, runs - 1))))
        showing = max(showing, runs)
    return RunAgreement(probability=probability, runs=showing)


def _split(near: Estimate, index: int, widest: float) -> _Split:
    """Give each run a size of its own, at a fit with one size for all.

    index : of the size among the unknowns; widest : prior standard deviation of the changes
    """
    slopes = [_by_run(j, index, k, near) for k, j in enumerate(_parts(near.jacobians))]
    residuals = _parts(near.residuals)
    others = [(u, float(z)) for u, z in zip(near.unknowns, near.z, strict=True)]
    del others[index]
    precision = [u.scaled_std**-2.0 for u, _ in others] + [widest**-2.0] * len(slopes)
    # What a prior pulls at the fit, the residuals pull the other way.
    pull = [0.0 if u.std is None else (z - u.scaled(u.prior)) for u, z in others]
    gradient = np.array(precision) * np.array([*pull, *np.zeros(len(slopes))])
    information = np.diag(precision)
    for columns, residual in zip(slopes, residuals, strict=True):
        rows = columns.reshape(-1, len(precision))
        information = information + rows.T @ rows
        gradient = gradient + rows.T @ residual.ravel()
    covariance = np.linalg.pinv(information, hermitian=True)
    change = -covariance @ gradient
    left = tuple(r + columns @ change for r, columns in zip(residuals, slopes, strict=True))
    square = sum(float(np.sum(r**2)) for r in left) / near.samples
    k = len(slopes)
    return _Split(
        changes=change[-k:],
        covariance=covariance[-k:, -k:],
        inflation=max(1.0, square) / effective_fraction(replace(near, residuals=left)),
    )


def _by_run(slopes: Array, index: int, run: int, near: Estimate) -> Array:
    """Slopes of a run, with its own column of a size among those of all runs at the end."""
    own = np.zeros((*slopes.shape[:2], len(_parts(near.residuals))))
    own[..., run] = slopes[..., index]
    return np.concatenate([np.delete(slopes, index, axis=-1), own], axis=-1)


def _parts(runs: Sequence[Array]) -> list[Array]:
    """The runs, shape (channels, samples, ...) each, or the halves of a single one."""
    return list(runs) if len(runs) > 1 else np.array_split(runs[0], 2, axis=1)


def _spread(values: Array, covariance: Array) -> float:
    """Chi squared of values with this covariance around their weighted mean [1]."""
    weights = np.linalg.inv(covariance)
    mean = (weights @ values).sum() / weights.sum()
    return float((values - mean) @ weights @ (values - mean))
