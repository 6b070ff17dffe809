"""Effects whose course is chance, as a dead time that varies from scan to scan.

No fit can follow such a course. What it leaves is unrest, the more so where the effect would move
a channel much: residuals of the variance

    1 + a^2 v

v : variance of the whitened channels over courses drawn by chance, of an effect of the size 1
a : its size, by maximum likelihood (a variance component: S. R. Searle, G. Casella,
    C. E. McCulloch, Variance Components, 1992)

Whatever else makes a residual large is restless elsewhere, or not random: the unrest has to be as
large as it says at every level of v, and nearly white.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from plant_emulator.diagnosis.fit_result import VarianceComponent
from plant_emulator.diagnosis.fitting.evidence import EVIDENCE_THRESHOLD
from plant_emulator.diagnosis.fitting.joint_fit import fit_from
from plant_emulator.estimation.covariance import structure

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import Recipe
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.signals.log import Array

# Courses that are drawn: their variance is known to 30 %.
REALISATIONS = 24
# Added variance from which on a sample is restless; quantiles that part these into levels.
RESTLESS, LEVELS = 0.05, (0.0, 0.25, 0.5, 0.75, 1.0)
# Mean square that is left at a level: known no better, for the courses are few and the scans of the
# machine others than the model's.
LEAST_LEFT, MOST_LEFT = 0.5, 2.0
# Structure left, as a share of the evidence: 0.0002 to 0.009 of such courses, 0.035 to 0.13 of
# coarse references.
LEFT_STRUCTURED = 0.01
# Of little evidence the share is larger, up to 0.036, for courses leave 400 to 900 of structure in
# three runs whatever their size, since scans and samples beat; coarse references left 60 000.
LITTLE_STRUCTURED, BEAT = 0.04, 350.0


def fit_random_effect(model: Model, task: Task) -> VarianceComponent:
    """Step of a diagnosis: the unrest that `task.effect` explains of a fit's residual.

    Where it does not hold, once more on the fit with its weights: restless samples, taken at the
    sensors' noise, draw a fit to their chance course, and what that leaves elsewhere is not random.
    Of what is random the likeliest of some shapes: a scan of exactly the log's period is seen at
    one phase only, any other at all.
    """
    candidate = model.candidates[task.effect]
    usual = {u.name: u.start for u in candidate.shapes}
    found = _variance_component(model, task, usual)
    if found.evidence <= EVIDENCE_THRESHOLD:
        return found
    if not found.consistent:
        weighted = cast(
            "Model", _WeightedModel(model, dict(zip(task.runs, found.weights, strict=True)))
        )
        task = replace(task, base=fit_from(weighted, task.base.effects, task.runs, task.base))
        found = _variance_component(model, task, usual)
    if not found.white:
        return found
    others = [_variance_component(model, task, usual | shape) for shape in _shapes(candidate)]
    return max([found, *others], key=lambda one: one.evidence)


def _shapes(candidate: Candidate) -> list[dict[str, float]]:
    """Shapes of an effect other than the usual one: each constant a deviation to either side."""
    return [
        {u.name: float(np.clip(u.start + side * u.std, u.lower, u.upper))}
        for u in candidate.shapes
        if u.std is not None
        for side in (-1.0, 1.0)
    ]


def _variance_component(model: Model, task: Task, shape: Mapping[str, float]) -> VarianceComponent:
    where, (size,) = task.base, model.candidates[task.effect].sizes
    residuals = [
        model.residual(run, where.effects)({**where.values, **states})
        for run, states in zip(task.runs, where.states, strict=True)
    ]
    variances = _variances(model, task, shape, size.start)
    counted = [residual != 0.0 for residual in residuals]
    squares = np.concatenate([r[c] for r, c in zip(residuals, counted, strict=True)]) ** 2
    added = np.concatenate([v[c] for v, c in zip(variances, counted, strict=True)])
    found, error, evidence = _most_likely(squares, added, size.upper)
    weights = tuple(1.0 / np.sqrt(1.0 + found**2 * v) for v in variances)
    left = sum(
        structure(channel)
        for residual, weight in zip(residuals, weights, strict=True)
        for channel in residual * weight
    )
    return VarianceComponent(
        effect=task.effect,
        parameter=size.name,
        size=found,
        standard_error=error,
        shape=shape,
        evidence=evidence,
        weights=weights,
        homoscedastic=_even(squares, found**2 * added),
        white=left
        < max(
            LEFT_STRUCTURED * evidence,
            min(LITTLE_STRUCTURED * evidence, BEAT * len(residuals)),
        ),
    )


def _variances(model: Model, task: Task, shape: Mapping[str, float], size: float) -> list[Array]:
    """Variance of every run's whitened channels over the courses, of the size 1."""
    where, candidate = task.base, model.candidates[task.effect]
    random = np.random.default_rng(0)
    found = []
    for run, states in zip(task.runs, where.states, strict=True):
        residual = model.residual(run, (*where.effects, task.effect))
        plain = {**where.values, **states, **shape, candidate.sizes[0].name: size}
        courses = [
            residual({**plain, **{u.name: _drawn(u, random) for u in candidate.stochastic}})
            for _ in range(REALISATIONS)
        ]
        found.append(np.var(np.stack(courses), axis=0, ddof=1) / size**2)
    return found


def _drawn(unknown: Unknown, random: np.random.Generator) -> float:
    return float(random.uniform(unknown.lower, unknown.upper))


def _most_likely(squares: Array, added: Array, upper: float) -> tuple[float, float, float]:
    """Size, its standard error, and the evidence; squares, added : of the samples that count."""
    from scipy.optimize import minimize_scalar

    def loss(size: float) -> float:
        total = 1.0 + size * size * added
        return float(np.sum(np.log(total) + squares / total))

    found = minimize_scalar(loss, bounds=(0.0, upper), method="bounded", options={"xatol": 1e-7})
    size = float(found.x)
    step = 1e-3 * size
    bend = (loss(size + step) - 2.0 * loss(size) + loss(size - step)) / step**2
    error = (2.0 / bend) ** 0.5 if bend > 0.0 else float("inf")
    return size, error, max(0.0, loss(0.0) - loss(size))


def _even(squares: Array, added: Array) -> bool:
    """Whether the residual is as restless as the added variance says, at every level of it."""
    restless = added > RESTLESS
    if not restless.any():
        return False
    left, level = squares[restless] / (1.0 + added[restless]), added[restless]
    edges = np.quantile(level, LEVELS)
    bins = np.clip(np.searchsorted(edges, level, side="right") - 1, 0, len(edges) - 2)
    means = [left[bins == k].mean() for k in range(len(edges) - 1) if (bins == k).any()]
    return bool(min(means) > LEAST_LEFT and max(means) < MOST_LEFT)


class _WeightedModel:
    """A model whose residuals are weighted; all else as it is."""

    def __init__(self, model: Model, weights: Mapping[int, Array]) -> None:
        self._model, self._weights = model, weights

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Model:
        """See `Model`; the planned runs come behind its own, without unrest."""
        return cast(
            "Model", _WeightedModel(self._model.with_planned_runs(where, runs), self._weights)
        )

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        plain, weight = self._model.residual(run, effects), self._weights.get(run, 1.0)

        def residual(values: Mapping[str, float]) -> Array:
            return np.asarray(plain(values) * weight)

        return residual


@dataclass(frozen=True)
class WeightedRecipe:
    """What builds a model whose noise is larger by an unrest; weights : of the model's runs."""

    recipe: Recipe
    weights: tuple[Array, ...]

    def build(self) -> Model:
        """The model."""
        return cast("Model", _WeightedModel(self.recipe.build(), dict(enumerate(self.weights))))

    def digest(self) -> str:
        """The same for the same model only."""
        own = hashlib.sha256(self.recipe.digest().encode())
        for weight in self.weights:
            own.update(np.ascontiguousarray(weight).tobytes())
        return own.hexdigest()
