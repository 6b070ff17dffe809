"""From the logs to a verdict: the contest, and once more where chance makes the logs restless."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.evidence import EVIDENCE_THRESHOLD, NOISE_MEAN_SQUARE, excess
from plant_emulator.diagnosis.fitting.input_noise_model import whiten_inputs
from plant_emulator.diagnosis.fitting.random_effects import WeightedRecipe, fit_random_effect
from plant_emulator.diagnosis.fitting.steps import refit, start
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.selection import run_consistency, verdict
from plant_emulator.diagnosis.selection.stepwise import Contest

if TYPE_CHECKING:
    from collections.abc import Iterable

    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.fit_result import FitResult, VarianceComponent
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.selection.verdict import Decision

# Structure of a residual, as a share of its squares beyond the noise, up to which it may be chance:
# that of a dead time that varies from scan to scan was 0.014.
RANDOM = 0.05


@dataclass(frozen=True, kw_only=True)
class Procedure:
    """One diagnosis up to its verdict.

    runs : that are fitted, by number; null : the fit without effects, if it has been made
    """

    pool: Pool
    recipe: Recipe
    model: Model
    runs: tuple[int, ...]
    null: FitResult | None = None

    def with_quiet_inputs(self) -> Procedure:
        """The same with the noise of fed inputs as part of the noise."""
        recipe, null = whiten_inputs(self.pool, self.recipe, self.model, self.runs)
        return replace(self, recipe=recipe, null=null)

    def found(self) -> tuple[Explanation, Decision, Recipe]:
        """What the contest came to, the verdict, and the recipe whose noise its costs count in."""
        if not self.model.reaches_noise:
            explained = self._contest(self.recipe, self.null)
            found = verdict.decide(self.model, explained)
            return explained, self._between(explained, found), self.recipe
        (null,) = [self.null] if self.null else self.pool.map(start, self.recipe, [self.runs])
        explained, recipe = self._restless(null) or (self._contest(self.recipe, null), self.recipe)
        found = verdict.decide(self.model, explained)
        if found.kind == "unknown" and not explained.random_effects:
            again = self._by_chance(explained.final, explained.null)
            explained, recipe = again or (explained, recipe)
            found = verdict.decide(self.model, explained)
        if found.kind == "unknown":
            found = self._between(explained, found)
        return explained, found, recipe

    def _contest(
        self, recipe: Recipe, null: FitResult | None, by_chance: float = 0.0
    ) -> Explanation:
        contest = Contest(
            self.pool,
            recipe,
            tuple(self.model.candidates),
            self.runs,
            reaches_noise=self.model.reaches_noise,
            by_chance=by_chance,
            null=null,
            exact=[name for name, one in self.model.candidates.items() if one.exact_form],
            subsystems={name: one.subsystem for name, one in self.model.candidates.items()},
        )
        return contest.explain()

    def _restless(self, null: FitResult) -> tuple[Explanation, Recipe] | None:
        """The contest with an effect of chance course, where the fit without effects leaves much,
        but next to nothing that is not random: a contest of others would be in vain.
        """
        if null.mean_square <= NOISE_MEAN_SQUARE or null.ljung_box_excess > RANDOM * excess(null):
            return None
        return self._by_chance(null, null)

    def _by_chance(self, base: FitResult, null: FitResult) -> tuple[Explanation, Recipe] | None:
        """The contest with the unrest of the effect of chance course that explains most on top of
        a fit, and the recipe with it; None where there is none.

        null : the fit without effects
        """
        found = self._random_effects(base, self.model.candidates)
        first = max(found, key=lambda one: one.evidence, default=None)
        if first is None:
            return None
        weights = dict(zip(self.runs, first.weights, strict=True))
        every = tuple(weights.get(k, np.ones(1)) for k in range(len(self.model.runs)))
        recipe = WeightedRecipe(self.recipe, every)
        (null,) = self.pool.map(refit, recipe, [Task(base=null, runs=self.runs)])
        again = self._contest(recipe, null, first.evidence)
        last = self._random_effects(again.final, [first.effect])
        return (replace(again, random_effects=tuple(last)), recipe) if last else None

    def _random_effects(self, base: FitResult, names: Iterable[str]) -> list[VarianceComponent]:
        """What holds of effects of chance course on top of a fit."""
        tasks = [
            Task(base=base, runs=self.runs, effect=name)
            for name in names
            if self.model.candidates[name].stochastic
        ]
        found = self.pool.map(fit_random_effect, self.recipe, tasks)
        return [one for one in found if one.consistent and one.evidence > EVIDENCE_THRESHOLD]

    def _between(self, explained: Explanation, found: Decision) -> Decision:
        """The verdict; unknown with that reason where runs agree each alone, but not together."""
        runs = self.runs
        if explained.unconverged or len(runs) < 2:
            return found
        tasks = [Task(base=explained.null, runs=(run,)) for run in runs]
        points = list(self.pool.map(run_consistency.alone, self.recipe, tasks))
        reason = run_consistency.between(self.model, runs, points, explained.final)
        return replace(found, kind="unknown", effects=(), reason=reason) if reason else found
