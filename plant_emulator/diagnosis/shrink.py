"""How far the gap shrinks, on runs that were not fitted.

A fold fits on some runs and predicts others; a predicted run keeps all parameters, and only its own
start states are fitted to it. The gap of a model is what its predictions leave, all held-out
samples of a channel pooled; intervals come from resampling blocks of time that are longer than the
residual's memory (moving-block bootstrap: Kunsch, Annals of Statistics 17 (1989) 1217).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.covariance import correlation_time
from plant_emulator.diagnosis.contest import Point, again, linearised
from plant_emulator.diagnosis.tangents import Tangents
from plant_emulator.estimation import estimate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.estimates import Array

# A channel counts in the closed fraction from this gap on, in the noise.
OPEN = 1.1
# Times that a fit that ran out of steps is taken up again.
PATIENCE = 3
BLOCK = 3.0
RESAMPLED = 400
SEED = 1


@dataclass(frozen=True, kw_only=True)
class Fold:
    """Runs to fit, and runs to predict.

    start : where the fit begins, with the states of the fitted runs
    refitted : False: the start's values are taken as they are
    as_fitted : the predicted run is a later part of the fitted one, and starts as that does
    """

    fitted: tuple[int, ...]
    predicted: tuple[int, ...]
    start: Point
    refitted: bool = True
    as_fitted: bool = False


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """The whitened residual of predicted runs, one array a run, shape (channels, samples).

    converged : the fit, and those of the predicted runs' own states
    """

    residuals: tuple[Array, ...]
    converged: bool


def predict(model: Model, fold: Fold) -> Prediction:
    """Fit the fold's model on its runs, and predict the others."""
    point = refitted(model, fold) if fold.refitted else fold.start
    known = point.states[0] if fold.as_fitted else None
    found = [_predicted(model, point, run, known) for run in fold.predicted]
    return Prediction(
        residuals=tuple(residual for residual, _ in found),
        converged=(point.converged or not fold.refitted) and all(ended for _, ended in found),
    )


def refitted(model: Model, fold: Fold) -> Point:
    """The fold's model fitted on its runs, taken up again where it ran out of steps."""
    point = fold.start
    for _ in range(1 + PATIENCE):
        point = again(model, point.effects, fold.fitted, point)
        if point.converged:
            break
    return point


def shown(model: Model, fold: Fold) -> dict[str, float]:
    """What each effect of the fold's start does to the fitted runs that drift cannot [noise]."""
    return {name: _shown(model, fold, name) for name in fold.start.effects}


def _shown(model: Model, fold: Fold, name: str) -> float:
    start = fold.start
    without = replace(start, effects=tuple(e for e in start.effects if e != name))
    tangents = Tangents(linearised(model, without, fold.fitted))
    complete = [
        model.residual(run, start.effects)({**start.values, **states}).ravel()
        for run, states in zip(fold.fitted, start.states, strict=True)
    ]
    return float(np.linalg.norm(tangents.rest(np.concatenate(complete) - tangents.residual)))


def _predicted(
    model: Model, point: Point, run: int, known: Mapping[str, float] | None
) -> tuple[Array, bool]:
    """Residual of a run with all parameters kept, its own states fitted unless known; converged."""
    effects = point.effects
    residual = model.residual(run, effects)

    def of(found: Mapping[str, float]) -> Array:
        return residual({**point.values, **found})

    own = (*model.states, *(u for name in effects for u in model.candidates[name].states))
    if known is not None or not own:
        return of(known or {}), True
    start = model.start_states(run, effects, point.values)
    states = [replace(u, run=0, start=float(np.clip(start[u.name], u.lower, u.upper))) for u in own]
    found = estimate(states, [of])
    return found.residuals[0], found.converged


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The held-out gap of a model: rms of the whitened residual of every channel, and its blocks.

    squares, counts : sums of squares and samples, shape (channels, blocks)
    """

    channels: tuple[str, ...]
    squares: Array
    counts: Array

    @property
    def by_channel(self) -> Array:
        """Rms over the noise, shape (channels,)."""
        return np.asarray(np.sqrt(self.squares.sum(axis=1) / self.counts.sum(axis=1)))


def gap(
    channels: Sequence[Sequence[str]], predictions: Sequence[Prediction], blocks: Sequence[int]
) -> Gap:
    """The gap from the predictions of all folds.

    channels : of every predicted run; blocks : samples of a block, of every predicted run
    """
    names = tuple(dict.fromkeys(name for run in channels for name in run))
    residuals = [r for prediction in predictions for r in prediction.residuals]
    squares, counts = [], []
    for run, residual, length in zip(channels, residuals, blocks, strict=True):
        for begin in range(0, residual.shape[1], length):
            part = residual[:, begin : begin + length]
            rows = {name: part[k] for k, name in enumerate(run)}
            squares.append([float(np.sum(rows[n] ** 2)) if n in rows else 0.0 for n in names])
            counts.append([int(np.count_nonzero(rows[n])) if n in rows else 0 for n in names])
    return Gap(channels=names, squares=np.array(squares).T, counts=np.array(counts, float).T)


def block_lengths(predictions: Sequence[Prediction]) -> list[int]:
    """Samples of a block for every predicted run: some memories of its residual."""
    return [
        max(1, round(BLOCK * max(correlation_time(channel) for channel in residual)))
        for prediction in predictions
        for residual in prediction.residuals
    ]


def closed_fraction(
    reference: Gap, explained: Gap, chosen: NDArray[np.intp] | None = None
) -> float | None:
    """Share of the gap beyond the noise that an explanation closes; None where there is no gap.

    1 - sum max(0, explained^2 - 1) / sum (reference^2 - 1), over channels with a reference of OPEN
    or more, all in the noise.   chosen : blocks that count, with repetition
    """
    blocks = np.arange(reference.squares.shape[1]) if chosen is None else chosen
    before = reference.squares[:, blocks].sum(axis=1) / reference.counts[:, blocks].sum(axis=1)
    after = explained.squares[:, blocks].sum(axis=1) / explained.counts[:, blocks].sum(axis=1)
    counting = reference.by_channel >= OPEN
    if not counting.any():
        return None
    gap_before = float(np.sum(before[counting] - 1.0))
    if gap_before <= 0.0:
        return None
    return 1.0 - float(np.sum(np.maximum(0.0, after[counting] - 1.0))) / gap_before


def interval(reference: Gap, explained: Gap) -> tuple[float, float] | None:
    """95 % interval of the closed fraction."""
    if closed_fraction(reference, explained) is None:
        return None
    random = np.random.default_rng(SEED)
    count = reference.squares.shape[1]
    drawn = [
        closed_fraction(reference, explained, chosen)
        for chosen in random.integers(0, count, size=(RESAMPLED, count))
    ]
    low, high = np.quantile([d for d in drawn if d is not None], [0.025, 0.975])
    return float(low), float(high)


def combined(found: Gap) -> tuple[float, float, float]:
    """Rms over all channels, in the noise, with its 95 % interval."""
    random = np.random.default_rng(SEED)
    count = found.squares.shape[1]

    def rms(blocks: NDArray[np.intp]) -> float:
        return float(np.sqrt(found.squares[:, blocks].sum() / found.counts[:, blocks].sum()))

    drawn = [rms(chosen) for chosen in random.integers(0, count, size=(RESAMPLED, count))]
    low, high = np.quantile(drawn, [0.025, 0.975])
    return rms(np.arange(count)), float(low), float(high)
