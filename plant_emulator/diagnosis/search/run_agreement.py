"""Whether the runs agree on the size of an effect.

An effect has one size in all runs. An effect that stands for the error of another one's law follows
what differs from run to run. At a fit, the Jacobian's column of a size s is split into one column a
part of the logs: least squares then tell a size of its own for each part, beside all other
unknowns. The sizes s_k, with covariance C, agree where chance leaves their chi squared,

    (s_k - m)' V^-1 (s_k - m),   V = C + (e d)^2 I

m is their weighted mean, e the relative error of a law in one of them, and d the size whose column
alone is as long as what all sizes of the effect change: any one of them may have to follow what the
law lacks, and one that changes little refutes nothing. For an effect of one size that is the size
itself. It is the test of homogeneity of effect sizes (W. Cochran, Biometrics 10 (1954) 101).

Each run is a part. A run that alone shows the effect has nothing to agree with: it is two parts. So
is each run of an effect with an angle of its own in each run: the amplitude of a wave is positive
in all of them, whatever its angle follows. An error that is the same in all parts, as in logs of
one program, is not found. A size with many narrow basins is not asked: its slope tells nothing of
another basin.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc

from plant_emulator.diagnosis.fitting.joint_fit import SHRINKAGE, linearise
from plant_emulator.diagnosis.fitting.relaxation import Relaxed, relax
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.unknowns import Unknown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.search.confirmation import Reduction
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.signals.log import Array


def run_agreement(model: Model, asked: Reduction) -> float:
    """Probability that the parts differ so much by chance and by a law's error (a step).

    It is that of the size of the effect of a fit on which they differ most. A part that does not
    show a size has its prior, and counts as none.
    """
    candidate = model.candidates[asked.effect]
    near = linearise(model, asked.base, asked.runs)
    names = [u.name for u in near.unknowns]
    sizes = [(names.index(u.name), u.scaled(candidate.neutral[u.name])) for u in candidate.sizes]
    halved = range(len(asked.runs)) if any(u.angle for u in candidate.states) else ()
    probability = 1.0
    for unknown in (u for u in candidate.sizes if u.step is None):
        index, neutral = names.index(unknown.name), unknown.scaled(candidate.neutral[unknown.name])
        widest = SHRINKAGE * abs(unknown.scaled(unknown.start) - neutral)
        split = _split(near, index, widest, halved)
        if not halved and _showing(split, widest) < 2:
            alone = int(np.argmin(np.diag(split.covariance)))
            split = _split(near, index, widest, (alone,))
        law = SETTINGS.run_error * _whole(near, index, sizes)
        spread = _spread(
            split.change, split.inflation * split.covariance + law**2 * np.eye(len(split.change))
        )
        probability = min(probability, float(chdtrc(max(1, _showing(split, widest) - 1), spread)))
    return probability


def _whole(near: Estimate, index: int, sizes: Sequence[tuple[int, float]]) -> float:
    """The size whose column alone is as long as what all sizes of the effect change [scaled size].

    index : of the size among the unknowns; sizes : of the effect, index and neutral value of each
    0 where no sample shows the size: it has nothing to differ by
    """
    away = np.zeros(len(near.z))
    for i, neutral in sizes:
        away[i] = near.z[i] - neutral
    change = [float(np.sum((j @ away) ** 2)) for j in near.jacobians]
    column = [float(np.sum(j[..., index] ** 2)) for j in near.jacobians]
    return float(np.sqrt(sum(change) / (sum(column) or np.inf)))


def _showing(split: Relaxed, widest: float) -> int:
    """Number of parts that show the size."""
    return round(float(np.sum(1.0 - np.diag(split.covariance) / widest**2)))


def _split(near: Estimate, index: int, widest: float, halved: Sequence[int]) -> Relaxed:
    """Changes of the size of each part, at a fit with one size for all.

    index : of the size among the unknowns; widest : prior standard deviation of the changes
    halved : runs of two parts
    """
    slopes = [
        np.concatenate([np.delete(j, index, axis=-1), j[..., [index]] * own], axis=-1)
        for j, own in zip(near.jacobians, _parts(near, index, halved), strict=True)
    ]
    k = slopes[0].shape[-1] - len(near.z) + 1
    own = Unknown(name="", start=0.0, lower=-inf, upper=inf, logarithmic=False, std=widest)
    beside = relax(
        replace(
            near,
            unknowns=(*near.unknowns[:index], *near.unknowns[index + 1 :], *([own] * k)),
            z=np.append(np.delete(near.z, index), np.zeros(k)),
            jacobians=tuple(slopes),
        )
    )
    return replace(beside, change=beside.change[-k:], covariance=beside.covariance[-k:, -k:])


def _parts(near: Estimate, index: int, halved: Sequence[int]) -> list[Array]:
    """Which part each sample of a run belongs to, one column of 0 and 1 a part.

    The second part of a run begins where half of the column's sum of squares is past.
    """
    parts = [np.full(j.shape[1], k) for k, j in enumerate(near.jacobians)]
    for more, run in enumerate(halved):
        past = np.cumsum(np.sum(near.jacobians[run][..., index] ** 2, axis=0))
        parts[run][2.0 * past > past[-1]] = len(parts) + more
    every = np.eye(len(parts) + len(halved))
    return [every[part] for part in parts]


def _spread(values: Array, covariance: Array) -> float:
    """Chi squared of values with this covariance around their weighted mean [1]."""
    weights = np.linalg.inv(covariance)
    mean = (weights @ values).sum() / weights.sum()
    return float((values - mean) @ weights @ (values - mean))
