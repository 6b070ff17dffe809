"""Random effects: effects whose course is chance, such as a dead time that varies at each scan.

No fit can follow a random course. The course leaves a residual whose variance is larger wherever
the effect would move a channel. The whitened residual then has the variance

    1 + a^2 v

v : variance of the whitened channels over courses that are drawn at random, for an effect of size 1
a : size of the effect, a variance component estimated by maximum likelihood (S. R. Searle,
    G. Casella, C. E. McCulloch, Variance Components, 1992)

Another cause leaves a large residual at other samples, in a part of the runs, or a residual that is
not random. A random effect therefore counts only where the weighted residual has the same variance
at every level of v, and is nearly white, and where no run speaks against it.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from plant_emulator.diagnosis.fit_result import VarianceComponent
from plant_emulator.diagnosis.fitting.evidence import EVIDENCE_THRESHOLD
from plant_emulator.diagnosis.fitting.joint_fit import AT_BOUND, fit_from
from plant_emulator.estimation.covariance import structure
from plant_emulator.estimation.nearby import Changed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import Recipe
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.signals.log import Array

# Courses that are drawn: the standard deviation over them is known to 15 %.
REALISATIONS = 24
# Added variance from which on a sample shows the effect, and quantiles that divide such samples
# into levels.
SHOWN_VARIANCE, LEVELS = 0.05, (0.0, 0.25, 0.5, 0.75, 1.0)
# Mean square that may be left at a level. The bounds are wide: the courses are few, and the
# machine's scans differ from the model's.
LEAST_MEAN_SQUARE, MOST_MEAN_SQUARE = 0.5, 2.0
# Ljung-Box excess that may be left in a run, and as a share of the evidence. Random courses leave
# up to 410 a run whatever their size, because scans and samples beat, and coarse references that
# pass as random left 640 and more.
MOST_EXCESS, EXCESS_SHARE = 500.0, 0.04


def fit_random_effect(model: Model, task: Task) -> VarianceComponent:
    """Fit the random effect `task.effect` to the residual of the fit `task.base` (a step).

    A fit at the sensors' noise follows the chance course, and leaves a residual elsewhere that is
    not random. The component is then fitted again on a fit with its own weights, unless it is as
    large as it may be, and stands for something else. Where the result is white, the likeliest of
    several shapes counts: a scan of exactly the log's period shows one phase only.
    """
    candidate = model.candidates[task.effect]
    usual = {u.name: u.start for u in candidate.shapes}
    found = _fit_component(model, task, usual)
    if found.evidence <= EVIDENCE_THRESHOLD:
        return found
    (size,) = candidate.sizes
    if not found.consistent and found.size < AT_BOUND * size.upper:
        weights = dict(zip(task.runs, found.weights, strict=True))
        weighted = cast("Model", _WeightedModel(model, weights))
        task = replace(task, base=fit_from(weighted, task.base.effects, task.runs, task.base))
        found = _fit_component(model, task, usual)
    if not found.white:
        return found
    others = [_fit_component(model, task, usual | shape) for shape in _other_shapes(candidate)]
    return max([found, *others], key=lambda one: (one.consistent, one.evidence))


def _other_shapes(candidate: Candidate) -> list[dict[str, float]]:
    """Shapes with one constant a prior standard deviation to either side of the usual value."""
    return [
        {u.name: float(np.clip(u.start + side * u.std, u.lower, u.upper))}
        for u in candidate.shapes
        if u.std is not None
        for side in (-1.0, 1.0)
    ]


def _fit_component(model: Model, task: Task, shape: Mapping[str, float]) -> VarianceComponent:
    """Fit the variance component of an effect of this shape."""
    base, (size,) = task.base, model.candidates[task.effect].sizes
    residuals = [
        model.residual(run, base.effects)({**base.values, **states})
        for run, states in zip(task.runs, base.states, strict=True)
    ]
    variances = _variances(model, task, shape, size.start)
    counted = [residual != 0.0 for residual in residuals]
    squares = np.concatenate([r[c] for r, c in zip(residuals, counted, strict=True)]) ** 2
    added = np.concatenate([v[c] for v, c in zip(variances, counted, strict=True)])
    found, error, evidence = _maximise_likelihood(squares, added, size.upper)
    of_runs = [
        _loss(r[c] ** 2, v[c], 0.0) - _loss(r[c] ** 2, v[c], found)
        for r, v, c in zip(residuals, variances, counted, strict=True)
    ]
    weights = tuple(1.0 / np.sqrt(1.0 + found**2 * v) for v in variances)
    weighted = [r * w for r, w in zip(residuals, weights, strict=True)]
    return VarianceComponent(
        effect=task.effect,
        parameter=size.name,
        size=found,
        standard_error=error,
        shape=shape,
        evidence=evidence,
        weights=weights,
        unopposed=min(of_runs) > -EVIDENCE_THRESHOLD,
        homoscedastic=_is_homoscedastic(squares, found**2 * added),
        white=_is_white(weighted, evidence),
    )


def _is_white(residuals: Sequence[Array], evidence: float) -> bool:
    """Whether the weighted residuals have no more Ljung-Box excess than random courses leave."""
    excess = sum(structure(channel) for residual in residuals for channel in residual)
    return excess < min(EXCESS_SHARE * evidence, MOST_EXCESS * len(residuals))


def _variances(model: Model, task: Task, shape: Mapping[str, float], size: float) -> list[Array]:
    """Variance v of each run's whitened channels over the courses, for an effect of size 1."""
    base, candidate = task.base, model.candidates[task.effect]
    random = np.random.default_rng(0)
    found = []
    for run, states in zip(task.runs, base.states, strict=True):
        residual = model.residual(run, (*base.effects, task.effect))
        plain = {**base.values, **states, **shape, candidate.sizes[0].name: size}
        courses = [
            residual({**plain, **{u.name: _draw(u, random) for u in candidate.stochastic}})
            for _ in range(REALISATIONS)
        ]
        found.append(np.var(np.stack(courses), axis=0, ddof=1) / size**2)
    return found


def _draw(unknown: Unknown, random: np.random.Generator) -> float:
    return float(random.uniform(unknown.lower, unknown.upper))


def _maximise_likelihood(squares: Array, added: Array, upper: float) -> tuple[float, float, float]:
    """Estimate the size a; give it, its standard error, and the evidence.

    squares : of the whitened residual's samples that count
    added : variance v of the same samples
    upper : bound of the size
    """
    from scipy.optimize import minimize_scalar

    def loss(size: float) -> float:
        return _loss(squares, added, size)

    found = minimize_scalar(loss, bounds=(0.0, upper), method="bounded", options={"xatol": 1e-7})
    size = float(found.x)
    step = 1e-3 * size
    bend = (loss(size + step) - 2.0 * loss(size) + loss(size - step)) / step**2
    error = (2.0 / bend) ** 0.5 if bend > 0.0 else float("inf")
    return size, error, max(0.0, loss(0.0) - loss(size))


def _loss(squares: Array, added: Array, size: float) -> float:
    """Minus twice the log-likelihood of a size, but for a constant."""
    total = 1.0 + size * size * added
    return float(np.sum(np.log(total) + squares / total))


def _is_homoscedastic(squares: Array, added: Array) -> bool:
    """Whether the weighted residual has the same variance at every level of the added variance."""
    shown = added > SHOWN_VARIANCE
    if not shown.any():
        return False
    left, level = squares[shown] / (1.0 + added[shown]), added[shown]
    edges = np.quantile(level, LEVELS)
    bins = np.clip(np.searchsorted(edges, level, side="right") - 1, 0, len(edges) - 2)
    means = [left[bins == k].mean() for k in range(len(edges) - 1) if (bins == k).any()]
    return bool(min(means) > LEAST_MEAN_SQUARE and max(means) < MOST_MEAN_SQUARE)


class _WeightedModel:
    """A model with weighted residuals; everything else is the plain model's."""

    def __init__(self, model: Model, weights: Mapping[int, Array]) -> None:
        self._model, self._weights = model, weights

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Model:
        """See `Model`; the planned runs follow the model's own, and are not weighted."""
        return cast(
            "Model", _WeightedModel(self._model.with_planned_runs(where, runs), self._weights)
        )

    def observer(self, interval: float) -> Model:
        """See `Model`."""
        return cast("Model", _WeightedModel(self._model.observer(interval), self._weights))

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        weight = self._weights.get(run, 1.0)
        return Changed(self._model.residual(run, effects), lambda rows: rows * weight)


@dataclass(frozen=True)
class WeightedRecipe:
    """The recipe of a model whose noise is larger by a random effect; weights : of all its runs."""

    recipe: Recipe
    weights: tuple[Array, ...]

    def build(self) -> Model:
        """Build the model."""
        return cast("Model", _WeightedModel(self.recipe.build(), dict(enumerate(self.weights))))

    def digest(self) -> str:
        """Hash of the plain recipe and of the weights."""
        own = hashlib.sha256(self.recipe.digest().encode())
        for weight in self.weights:
            own.update(np.ascontiguousarray(weight).tobytes())
        return own.hexdigest()
