"""How far the gap shrinks, on runs that were not fitted.

A fold fits on some runs and predicts others; a predicted run keeps all parameters, and only its own
start states are fitted to it. The gap of a model is what its predictions leave, all held-out
samples of a channel pooled; intervals come from runs drawn anew in blocks of time (`resample`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.prediction import block_bootstrap
from plant_emulator.estimation.least_squares import estimate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import MeasuredRun, Model
    from plant_emulator.signals.log import Array

# A channel counts in the closed fraction from this gap on, in the noise.
OPEN = 1.1
# Times that a fit that ran out of steps is taken up again.
PATIENCE = 3


@dataclass(frozen=True, kw_only=True)
class Fold:
    """Runs to fit, and runs to predict.

    start : where the fit begins, with the states of the fitted runs
    refitted : False: the start's values are taken as they are
    as_fitted : the predicted run is a later part of the fitted one, and starts as that does
    """

    fitted: tuple[int, ...]
    predicted: tuple[int, ...]
    start: FitResult
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


def refitted(model: Model, fold: Fold) -> FitResult:
    """The fold's model fitted on its runs, taken up again where it ran out of steps.

    What these runs tell nothing of, as a pause that none of them has, would end anywhere.
    """
    point = fold.start
    for _ in range(1 + PATIENCE):
        point = fit(model, point.effects, fold.fitted, point.values, point.states, shrinkage=True)
        if point.converged:
            break
    return point


def shown(model: Model, fold: Fold) -> dict[str, float]:
    """What each effect of the fold's start does to the fitted runs that drift cannot [noise]."""
    return {name: _shown(model, fold, name) for name in fold.start.effects}


def _shown(model: Model, fold: Fold, name: str) -> float:
    start = fold.start
    without = replace(start, effects=tuple(e for e in start.effects if e != name))
    tangents = NuisanceSpace(linearise(model, without, fold.fitted))
    complete = [
        model.residual(run, start.effects)({**start.values, **states}).ravel()
        for run, states in zip(fold.fitted, start.states, strict=True)
    ]
    return float(np.linalg.norm(tangents.orthogonal(np.concatenate(complete) - tangents.residual)))


def _predicted(
    model: Model, point: FitResult, run: int, known: Mapping[str, float] | None
) -> tuple[Array, bool]:
    """Residual of a run with all parameters kept, its own states fitted unless known; converged."""
    effects = point.effects
    residual = model.residual(run, effects)

    def of(found: Mapping[str, float]) -> Array:
        return residual({**point.values, **found})

    own = (*model.states, *(u for name in effects for u in model.candidates[name].states))
    if known is not None or not own:
        return of(known or {}), True
    start = model.initial_states(run, effects, point.values)
    states = [replace(u, run=0, start=float(np.clip(start[u.name], u.lower, u.upper))) for u in own]
    found = estimate(states, [of])
    return found.residuals[0], found.converged


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The held-out gap of a model, of every channel that has held-out samples.

    noise : of a channel, pooled over the held-out samples, shape (channels,) [units]
    squares : of the residual in that noise, one array a run, shape (channels, samples)
    weights : variance of a sample's own noise in that noise; 0 where a sample does not count
    blocks : samples of a block of every run, see `resample`
    """

    channels: tuple[str, ...]
    noise: Array
    squares: tuple[Array, ...]
    weights: tuple[Array, ...]
    blocks: tuple[int, ...]

    @property
    def by_channel(self) -> Array:
        """Rms over the noise, shape (channels,)."""
        return np.asarray(np.sqrt(self.mean_squares[:, 0]))

    @property
    def mean_squares(self) -> Array:
        """Mean square over the noise's, shape (channels, 1)."""
        total = sum(squares.sum(axis=1, keepdims=True) for squares in self.squares)
        return np.asarray(total / sum(w.sum(axis=1, keepdims=True) for w in self.weights))

    @cached_property
    def drawn(self) -> tuple[Array, Array]:
        """Sums of squares and of weights in draws of the runs, shape (channels, draws) each."""
        return block_bootstrap.sums(self.squares, self.blocks), block_bootstrap.sums(
            self.weights, self.blocks
        )


def gap(
    runs: Sequence[MeasuredRun], predictions: Sequence[Prediction], blocks: Sequence[int]
) -> Gap:
    """The gap from the predictions of all folds; runs, blocks : of every predicted run."""
    residuals = [r for prediction in predictions for r in prediction.residuals]
    pairs = list(zip(runs, residuals, strict=True))
    names = tuple(
        dict.fromkeys(
            n for run, r in pairs for n, row in zip(run.channels, r, strict=True) if row.any()
        )
    )
    squares = [_rows(names, run, (r * run.noise[:, None]) ** 2) for run, r in pairs]
    weights = [_rows(names, run, (r != 0.0) * run.noise[:, None] ** 2) for run, r in pairs]
    counts = [_rows(names, run, (r != 0.0).astype(float)) for run, r in pairs]
    variance = sum(w.sum(axis=1) for w in weights) / sum(c.sum(axis=1) for c in counts)
    return Gap(
        channels=names,
        noise=np.asarray(np.sqrt(variance)),
        squares=tuple(s / variance[:, None] for s in squares),
        weights=tuple(w / variance[:, None] for w in weights),
        blocks=tuple(blocks),
    )


def _rows(names: Sequence[str], run: MeasuredRun, values: Array) -> Array:
    """A run's rows in the order of these channels; 0 of those that it has not."""
    nothing = np.zeros(values.shape[1])
    own = dict(zip(run.channels, values, strict=True))
    return np.stack([own.get(name, nothing) for name in names])


def block_lengths(predictions: Sequence[Prediction]) -> list[int]:
    """Samples of a block for every predicted run."""
    return [
        block_bootstrap.block_length(r) for prediction in predictions for r in prediction.residuals
    ]


def closed_fraction(reference: Gap, explained: Gap) -> float | None:
    """Share of the gap beyond the noise that an explanation closes; None where there is no gap.

    1 - sum max(0, explained^2 - 1) / sum (reference^2 - 1), over channels with a reference of OPEN
    or more, all in the noise.
    """
    (found,) = _closed(reference, reference.mean_squares, explained.mean_squares)
    return float(found) if np.isfinite(found) else None


def _closed(reference: Gap, before: Array, after: Array) -> Array:
    """The closed fraction of mean squares, shape (channels, draws); NaN where there is no gap."""
    counting = reference.by_channel >= OPEN
    gap_before = np.sum(before[counting] - 1.0, axis=0)
    left = np.sum(np.maximum(0.0, after[counting] - 1.0), axis=0)
    there = gap_before > 0.0
    return np.where(there, 1.0 - left / np.where(there, gap_before, 1.0), np.nan)


def interval(reference: Gap, explained: Gap) -> tuple[float, float] | None:
    """95 % interval of the closed fraction; draws without samples of a channel do not count."""
    if closed_fraction(reference, explained) is None:
        return None
    with np.errstate(invalid="ignore"):
        before, after = (np.divide(*found.drawn) for found in (reference, explained))
    drawn = _closed(reference, before, after)
    drawn = drawn[np.isfinite(drawn)]
    if not len(drawn):
        return None
    low, high = np.quantile(drawn, [0.025, 0.975])
    return float(low), float(high)


def combined(found: Gap) -> tuple[float, float, float]:
    """Rms over all channels, in the noise, with its 95 % interval."""
    squares, weights = found.drawn
    low, high = np.nanquantile(np.sqrt(squares.sum(axis=0) / weights.sum(axis=0)), [0.025, 0.975])
    total = sum(s.sum() for s in found.squares) / sum(w.sum() for w in found.weights)
    return float(np.sqrt(total)), float(low), float(high)
