"""Whether the runs confirm an effect: they show it with the same size.

An effect has one size in all runs. An effect that stands for the error of another one's law follows
what differs from run to run. At a fit, the Jacobian's column of a size s is split into one column a
run: least squares then tell a size of its own for each run, beside all other unknowns. The sizes
s_k, with covariance C, agree where chance leaves their chi squared,

    (s_k - m)' V^-1 (s_k - m),   V = C + (e s)^2 I

m is their weighted mean, e the relative error of an approximate law. It is the test of homogeneity
of effect sizes (W. Cochran, Biometrics 10 (1954) 101). A single run is split into its two halves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2

from plant_emulator.diagnosis.fitting.joint_fit import (
    SHRINKAGE,
    SIGNIFICANT_ERRORS,
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

    probability : that chance and approximate laws make its sizes differ so much between runs [1]
    runs : number of runs each of which tells a size for certain
    """

    probability: float
    runs: int


def run_agreement(model: Model, asked: Reduction) -> RunAgreement:
    """What the runs say of an effect of a fit, of its size on which they differ most (a step)."""
    found, candidate = asked.base, model.candidates[asked.effect]
    near = linearise(model, found, asked.runs)
    inflation = max(1.0, found.mean_square) / effective_fraction(near)
    names = [u.name for u in near.unknowns]
    probability, telling = 1.0, 0
    for unknown in candidate.sizes:
        index, neutral = names.index(unknown.name), unknown.scaled(candidate.neutral[unknown.name])
        size = float(near.z[index]) - neutral
        if abs(size) <= SIGNIFICANT_ERRORS * near.standard_errors[index]:
            continue
        widest = SHRINKAGE * abs(unknown.scaled(unknown.start) - neutral)
        changes, covariance = _changes_by_run(near, index, widest)
        chance = inflation * covariance
        spread = _spread(changes, chance + (SETTINGS.law_error * size) ** 2 * np.eye(len(changes)))
        probability = min(probability, float(chi2.sf(spread, len(changes) - 1)))
        certain = np.abs(size + changes) > SIGNIFICANT_ERRORS * np.sqrt(np.diag(chance))
        telling = max(telling, int(np.sum(certain)))
    return RunAgreement(probability=probability, runs=telling)


def _changes_by_run(near: Estimate, index: int, widest: float) -> tuple[Array, Array]:
    """Changes of a size that each run asks for, shape (parts,), and their covariance.

    index : of the size among the unknowns
    widest : prior standard deviation of the changes; a run that does not show the size has it
    """
    slopes = [j.reshape(-1, len(near.z)) for j in _parts(near.jacobians)]
    residuals = [r.ravel() for r in _parts(near.residuals)]
    precision = np.array([u.scaled_std**-2.0 for u in near.unknowns])
    precision = np.append(np.delete(precision, index), np.full(len(slopes), widest**-2.0))
    information, gradient = np.diag(precision), np.zeros(len(precision))
    for k, (columns, residual) in enumerate(zip(slopes, residuals, strict=True)):
        own = np.zeros((len(columns), len(slopes)))
        own[:, k] = columns[:, index]
        rows = np.hstack([np.delete(columns, index, axis=1), own])
        information += rows.T @ rows
        gradient += rows.T @ residual
    covariance = np.linalg.pinv(information, hermitian=True)
    k = len(slopes)
    return -(covariance @ gradient)[-k:], covariance[-k:, -k:]


def _parts(runs: Sequence[Array]) -> list[Array]:
    """The runs, shape (channels, samples, ...) each, or the halves of a single one."""
    return list(runs) if len(runs) > 1 else np.array_split(runs[0], 2, axis=1)


def _spread(values: Array, covariance: Array) -> float:
    """Chi squared of values with this covariance around their weighted mean [1]."""
    weights = np.linalg.inv(covariance)
    mean = (weights @ values).sum() / weights.sum()
    return float((values - mean) @ weights @ (values - mean))
