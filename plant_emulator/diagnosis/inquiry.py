"""From the logs to a verdict: the contest, and once more where chance makes the logs restless."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis import apart, verdict
from plant_emulator.diagnosis.chance import Weighted, unrest
from plant_emulator.diagnosis.explain import THRESHOLD
from plant_emulator.diagnosis.quieted import quieted
from plant_emulator.diagnosis.steps import Task
from plant_emulator.diagnosis.stepwise import Contest

if TYPE_CHECKING:
    from collections.abc import Iterable

    from plant_emulator.diagnosis.chance import Unrest
    from plant_emulator.diagnosis.contest import Point
    from plant_emulator.diagnosis.explain import Explanation
    from plant_emulator.diagnosis.model import Model
    from plant_emulator.diagnosis.pool import Pool, Recipe
    from plant_emulator.diagnosis.rounds import Progress
    from plant_emulator.diagnosis.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class Inquiry:
    """One diagnosis up to its verdict.

    runs : that are fitted, by number; null : a fit without effects to start from, if there is one
    """

    pool: Pool
    recipe: Recipe
    model: Model
    runs: tuple[int, ...]
    progress: Progress | None = None
    null: Point | None = None

    def with_quiet_inputs(self) -> Inquiry:
        """The same with the noise of fed inputs as part of the noise."""
        recipe, null = quieted(self.pool, self.recipe, self.model, self.runs)
        return replace(self, recipe=recipe, null=null)

    def found(self) -> tuple[Explanation, Verdict]:
        """What the contest came to, and the verdict."""
        explained = self._contest(self.recipe)
        found = verdict.decide(self.model, explained)
        if found.kind == "unknown" and self.model.reaches_noise:
            explained = self._by_chance(explained)
            found = self._between(explained, verdict.decide(self.model, explained))
        return explained, found

    def _contest(self, recipe: Recipe, by_chance: float = 0.0) -> Explanation:
        contest = Contest(
            self.pool,
            recipe,
            tuple(self.model.candidates),
            self.runs,
            self.progress,
            reaches_noise=self.model.reaches_noise,
            by_chance=by_chance,
            null=self.null,
        )
        return contest.explain()

    def _by_chance(self, explained: Explanation) -> Explanation:
        """The contest again with the unrest of the effect of chance course that explains most; as
        it was where there is none.
        """
        found = self._unrest(explained.final, self.model.candidates)
        first = max(found, key=lambda one: one.evidence, default=None)
        if first is None:
            return explained
        weights = dict(zip(self.runs, first.weights, strict=True))
        every = tuple(weights.get(k, np.ones(1)) for k in range(len(self.model.runs)))
        again = self._contest(Weighted(self.recipe, every), first.evidence)
        last = self._unrest(again.final, [first.effect])
        return replace(again, chance=tuple(last)) if last else explained

    def _unrest(self, base: Point, names: Iterable[str]) -> list[Unrest]:
        """What holds of effects of chance course on top of a fit."""
        tasks = [
            Task(base=base, runs=self.runs, effect=name)
            for name in names
            if self.model.candidates[name].untold
        ]
        found = self.pool.map(unrest, self.recipe, tasks)
        return [one for one in found if one.holds and one.evidence > THRESHOLD]

    def _between(self, explained: Explanation, found: Verdict) -> Verdict:
        """The verdict; where nothing explains runs that each alone agree, with that reason."""
        runs = self.runs
        if found.kind != "unknown" or explained.unconverged or len(runs) < 2:
            return found
        tasks = [Task(base=explained.null, runs=(run,)) for run in runs]
        points = list(self.pool.map(apart.alone, self.recipe, tasks))
        reason = apart.between(self.model, runs, points)
        return replace(found, reason=reason) if reason else found
