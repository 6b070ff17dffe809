"""How far the gap shrinks on runs that were not fitted.

A fold fits some runs and predicts others. A predicted run keeps all parameters; only its own
initial states are fitted to it. The gap of a hypothesis is the root mean square of its predictions'
residuals, over all held-out samples of a channel. Intervals come from runs that are drawn anew in
blocks of time (`block_bootstrap`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.prediction import block_bootstrap
from plant_emulator.estimation.initial_states import fit_from
from plant_emulator.estimation.nearby import Beside

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import MeasuredRun, Model
    from plant_emulator.signals.log import Array

# Relative uncertainty of the noise's variance, one standard deviation.
NOISE_UNCERTAINTY = 0.02
# A channel counts in the closed fraction from this gap on, in the noise [1].
OPEN_GAP = 1.1
# A fit that ran out of iterations is continued at most so many times.
CONTINUATIONS = 3


@dataclass(frozen=True, kw_only=True)
class Fold:
    """A cross-validation fold: runs to fit, and runs to predict.

    start : fit to start from, with the states of the fitted runs
    states : of each predicted run, near those that suit it; none where they have to be looked for
    refitted : whether the runs are fitted; else the start's values are taken as they are
    as_fitted : whether the predicted run is a later part of the fitted one, and starts as that does
    """

    fitted: tuple[int, ...]
    predicted: tuple[int, ...]
    start: FitResult
    states: tuple[Mapping[str, float], ...] = ()
    refitted: bool = True
    as_fitted: bool = False


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """The residuals of predicted runs over their noise [1], shape (channels, samples) each.

    converged : whether the fit of the fold and the fits of the runs' own states converged
    """

    residuals: tuple[Array, ...]
    converged: bool


def predict(model: Model, fold: Fold) -> Prediction:
    """Fit the fold's hypothesis to its fitted runs, and predict the others (a step)."""
    found = refit_fold(model, fold) if fold.refitted else fold.start
    known = found.states[0] if fold.as_fitted else None
    near = fold.states or [None for _ in fold.predicted]
    predicted = [
        _predict_run(model, found, run, known, own)
        for run, own in zip(fold.predicted, near, strict=True)
    ]
    return Prediction(
        residuals=tuple(residual for residual, _ in predicted),
        converged=(found.converged or not fold.refitted) and all(ended for _, ended in predicted),
    )


def refit_fold(model: Model, fold: Fold) -> FitResult:
    """Fit the fold's hypothesis to its fitted runs, and continue until the fit converges.

    The sizes have a shrinkage prior: a size that these runs do not show would end anywhere. The fit
    to all runs is near, so that slopes are differenced there only and follow by secants.
    """
    found, near = fold.start, linearise(model, fold.start, fold.fitted)
    for _ in range(1 + CONTINUATIONS):
        found = fit(
            model,
            found.effects,
            fold.fitted,
            found.values,
            found.states,
            near=near,
            shrinkage=True,
        )
        if found.converged:
            break
    return found


def signature_norms(model: Model, fold: Fold) -> dict[str, float]:
    """Norm of each effect's orthogonal signature in the fitted runs, in the noise [1] (a step)."""
    return {name: _signature_norm(model, fold, name) for name in fold.start.effects}


def _signature_norm(model: Model, fold: Fold, name: str) -> float:
    start = fold.start
    without = replace(start, effects=tuple(e for e in start.effects if e != name))
    nuisance = NuisanceSpace(linearise(model, without, fold.fitted))
    complete = [
        model.residual(run, start.effects)({**start.values, **states}).ravel()
        for run, states in zip(fold.fitted, start.states, strict=True)
    ]
    return float(np.linalg.norm(nuisance.orthogonal(np.concatenate(complete) - nuisance.residual)))


def _predict_run(
    model: Model,
    found: FitResult,
    run: int,
    known: Mapping[str, float] | None,
    near: Mapping[str, float] | None,
) -> tuple[Array, bool]:
    """Residual of a run with all parameters kept, and whether the fit of its states converged.

    known : the run's states; None: they are fitted to it
    near : states to fit from; None: they are looked for
    """
    effects = found.effects
    residual = Beside(model.residual(run, effects), found.values)
    own = (*model.states, *(u for name in effects for u in model.candidates[name].states))
    states, converged = known or {}, True
    if known is None and own:
        start = near or model.initial_states(run, effects, found.values)
        estimated = fit_from(start, own, residual)
        states, converged = estimated.states(0), estimated.converged
    return model.unwhitened_residual(run, effects)({**found.values, **states}), converged


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The held-out gap of a hypothesis, for every channel with held-out samples.

    noise : of each channel, pooled over the held-out samples [units], shape (channels,)
    squares : of the residual over that noise, shape (channels, samples), one array a run
    weights : variance of each sample's own noise over that noise's, 0 where the sample does not
        count; same shapes
    blocks : samples of a block of each run, see `block_bootstrap`
    """

    channels: tuple[str, ...]
    noise: Array
    squares: tuple[Array, ...]
    weights: tuple[Array, ...]
    blocks: tuple[int, ...]

    @property
    def by_channel(self) -> Array:
        """Root mean square over the noise [1], shape (channels,)."""
        return np.asarray(np.sqrt(self.mean_squares[:, 0]))

    @property
    def mean_squares(self) -> Array:
        """Mean square over the noise's variance [1], shape (channels, 1)."""
        total = sum(squares.sum(axis=1, keepdims=True) for squares in self.squares)
        return np.asarray(total / sum(w.sum(axis=1, keepdims=True) for w in self.weights))

    @cached_property
    def resampled(self) -> tuple[Array, Array]:
        """Sums of squares and of weights in bootstrap draws, shape (channels, draws) each."""
        squares = block_bootstrap.resampled_sums(self.squares, self.blocks)
        return squares, block_bootstrap.resampled_sums(self.weights, self.blocks)


def measure_gap(
    runs: Sequence[MeasuredRun], predictions: Sequence[Prediction], blocks: Sequence[int]
) -> Gap:
    """Measure the gap of the predictions of all folds; runs, blocks : of every predicted run."""
    residuals = [r for prediction in predictions for r in prediction.residuals]
    pairs = list(zip(runs, residuals, strict=True))
    names = tuple(
        dict.fromkeys(
            n for run, r in pairs for n, row in zip(run.channels, r, strict=True) if row.any()
        )
    )
    levels = [run.noise[:, None] * run.noise_ratio for run, _ in pairs]
    squares = [_rows(names, run, (r * d) ** 2) for (run, r), d in zip(pairs, levels, strict=True)]
    weights = [
        _rows(names, run, (r != 0.0) * d**2) for (run, r), d in zip(pairs, levels, strict=True)
    ]
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
    """Rows of a run in the order of these channels; zeros for a channel that it lacks."""
    nothing = np.zeros(values.shape[1])
    own = dict(zip(run.channels, values, strict=True))
    return np.stack([own.get(name, nothing) for name in names])


def block_lengths(predictions: Sequence[Prediction]) -> list[int]:
    """Samples of a bootstrap block for every predicted run."""
    return [
        block_bootstrap.block_length(r) for prediction in predictions for r in prediction.residuals
    ]


def closed_fraction(reference: Gap, explained: Gap) -> float | None:
    """Share of the gap beyond the noise that a hypothesis closes [1]; None where there is no gap.

    1 - sum max(0, explained^2 - 1) / sum (reference^2 - 1)

    over the channels whose reference is OPEN_GAP or more; both gaps in the noise.
    """
    (found,) = _closed_fractions(reference, reference.mean_squares, explained.mean_squares)
    return float(found) if np.isfinite(found) else None


def _closed_fractions(reference: Gap, before: Array, after: Array) -> Array:
    """Closed fraction for mean squares of shape (channels, draws); NaN where there is no gap."""
    counting = reference.by_channel >= OPEN_GAP
    gap_before = np.sum(before[counting] - 1.0, axis=0)
    left = np.sum(np.maximum(0.0, after[counting] - 1.0), axis=0)
    there = gap_before > 0.0
    return np.where(there, 1.0 - left / np.where(there, gap_before, 1.0), np.nan)


def closed_fraction_interval(
    reference: Gap, explained: Gap, noise_mean_square: float = 1.0
) -> tuple[float, float] | None:
    """95 % interval of the closed fraction [1].

    noise_mean_square : mean square up to which what is left counts as noise [1]
    Each draw has a noise variance of its own in every channel, as uncertain as the estimate of it.
    A channel that leaves less than its noise shows that the noise is smaller, not that nothing is
    left: its noise is what it leaves. Draws without samples of a channel do not count.
    """
    if closed_fraction(reference, explained) is None:
        return None
    with np.errstate(invalid="ignore"):
        before, after = (np.divide(*found.resampled) for found in (reference, explained))
    level = np.minimum(1.0, explained.mean_squares)
    before, after = before / level, after / level / noise_mean_square
    errors = np.random.default_rng(block_bootstrap.SEED).standard_normal(before.shape)
    noise = 1.0 + NOISE_UNCERTAINTY * errors
    drawn = _closed_fractions(reference, before * noise, after * noise)
    drawn = drawn[np.isfinite(drawn)]
    if not len(drawn):
        return None
    low, high = np.quantile(drawn, [0.025, 0.975])
    return float(low), float(high)


def shows_shrinkage(reference: Gap, explained: Gap) -> bool:
    """Whether the 95 % interval of the closed fraction excludes 0; True where it is not defined."""
    interval = closed_fraction_interval(reference, explained)
    return interval is None or interval[0] > 0.0


def tells_share(reference: Gap, explained: Gap, *, faint: bool = False) -> bool:
    """Whether the 95 % interval of the closed fraction tells a share.

    faint : whether the fit to all runs without effects leaves nothing but noise

    Runs with much contact, or sizes that few runs show, are hard to predict from other runs: the
    interval is wider than the gap. What the others mispredict of a run may also hide a faint
    effect: the interval holds 0. That speaks neither for nor against an effect.
    """
    interval = closed_fraction_interval(reference, explained)
    if interval is None:
        return True
    low, high = interval
    return high - low <= 1.0 and not (faint and low <= 0.0 <= high)


def combined_gap(found: Gap) -> tuple[float, float, float]:
    """Root mean square over all channels, in the noise [1], and its 95 % interval."""
    squares, weights = found.resampled
    low, high = np.nanquantile(np.sqrt(squares.sum(axis=0) / weights.sum(axis=0)), [0.025, 0.975])
    total = sum(s.sum() for s in found.squares) / sum(w.sum() for w in found.weights)
    return float(np.sqrt(total)), float(low), float(high)
