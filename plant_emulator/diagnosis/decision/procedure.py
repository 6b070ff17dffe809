"""The diagnosis procedure: from the logs to a decision.

1. The noise of measured inputs is made part of the noise (`fitting.input_noise_model`), and the
   outliers are left out (`search.logged_noise`).
2. The fit without effects leaves the gap. Where the gap is random, a random effect may explain it
   (`fitting.random_effects`); it is then made part of the noise.
3. The search finds the set of effects that the logs ask for (`search.search`).
4. The evidence decides (`decision.verdict`). Where no effect is named, the runs are fitted one by
   one: they may each agree with the equations, but not with each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.decision import run_consistency
from plant_emulator.diagnosis.decision.verdict import decide
from plant_emulator.diagnosis.fitting.evidence import EVIDENCE_THRESHOLD, NOISE_MEAN_SQUARE, excess
from plant_emulator.diagnosis.fitting.fit_steps import refit, start
from plant_emulator.diagnosis.fitting.input_noise_model import whiten_inputs
from plant_emulator.diagnosis.fitting.random_effects import WeightedRecipe, fit_random_effect
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.logged_noise import WhitenedRecipe, mark_outliers
from plant_emulator.diagnosis.search.search import Search

if TYPE_CHECKING:
    from collections.abc import Iterable

    from plant_emulator.diagnosis.decision.verdict import Decision
    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult, VarianceComponent
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.estimation.noise.logged_noise import LoggedNoise

# Ljung-Box excess of a residual, as a share of its squares beyond the noise, up to which the gap
# may be random. A dead time that varies at each scan had left 0.014.
RANDOM_SHARE = 0.05


@dataclass(frozen=True, kw_only=True)
class Procedure:
    """One diagnosis up to its decision.

    null : fit without effects; None where it has not been made yet
    outliers : samples that the residual of that fit leaves out; None where there are none
    """

    runner: TaskRunner
    null: FitResult | None = None
    outliers: LoggedNoise | None = None

    def with_input_noise(self) -> Procedure:
        """Give the procedure with the noise of measured inputs as part of the noise."""
        runner, null = whiten_inputs(self.runner)
        return replace(self, runner=runner, null=null)

    def with_outliers_marked(self) -> Procedure:
        """Give the procedure with the fit without effects and the outliers that it leaves."""
        runs = self.runner.runs
        (null,) = [self.null] if self.null else self.runner.map(start, [runs])
        (noise,) = self.runner.map(mark_outliers, [Task(base=null, runs=runs)])
        spiky = any(channel.outliers for channel in noise.channels.values())
        return replace(self, null=null, outliers=noise if spiky else None)

    def run(self) -> tuple[Explanation, Decision, TaskRunner]:
        """Test the hypotheses and decide; give also the runner in whose noise the costs count."""
        model, runs = self.runner.model, self.runner.runs
        (null,) = [self.null] if self.null else self.runner.map(start, [runs])
        found = self._test_random_gap(null)
        if found is None:
            if self.outliers is not None:
                (null,) = self._cleared(self.runner).map(refit, [Task(base=null, runs=runs)])
            found = self._test_effects(self.runner, null)
        if decide(model, found[0]).kind == "unknown" and not found[0].random_effects:
            found = self._test_random_effects(found[0].final, found[0].null) or found
        explained, runner = found
        decision = decide(model, explained)
        if decision.kind == "unknown":
            decision = self._check_consistency(explained, decision)
        return explained, decision, runner

    def _cleared(self, runner: TaskRunner) -> TaskRunner:
        """Give a runner whose model leaves the outliers out."""
        if self.outliers is None:
            return runner
        return replace(runner, recipe=WhitenedRecipe(runner.recipe, self.outliers))

    def _test_effects(
        self, runner: TaskRunner, null: FitResult, random_evidence: float = 0.0
    ) -> tuple[Explanation, TaskRunner]:
        """Search the library; random_evidence : see `Search`.

        Give also the runner in whose noise the costs count.
        """
        search = Search(
            declared=runner,
            runner=runner if random_evidence else self._cleared(runner),
            null=null,
            random_evidence=random_evidence,
        )
        return search.explain(), search.runner

    def _test_random_gap(self, null: FitResult) -> tuple[Explanation, TaskRunner] | None:
        """Test the random effects first where the gap is large and random.

        Other effects would be tested in vain there. None: the gap is small or not random
        """
        small = null.mean_square <= NOISE_MEAN_SQUARE
        if small or null.ljung_box_excess > RANDOM_SHARE * excess(null):
            return None
        return self._test_random_effects(null, null)

    def _test_random_effects(
        self, base: FitResult, null: FitResult
    ) -> tuple[Explanation, TaskRunner] | None:
        """Test all effects with the best random effect as part of the noise.

        base : fit whose residual shows the random effect
        null : fit without effects
        None: no random effect explains the residual
        """
        runs, model = self.runner.runs, self.runner.model
        found = self._fit_random_effects(base, model.candidates)
        best = max(found, key=lambda one: one.evidence, default=None)
        if best is None:
            return None
        weights = dict(zip(runs, best.weights, strict=True))
        every = tuple(weights.get(k, np.ones(1)) for k in range(len(model.runs)))
        runner = replace(self.runner, recipe=WeightedRecipe(self.runner.recipe, every))
        (null,) = runner.map(refit, [Task(base=null, runs=runs)])
        explained, runner = self._test_effects(runner, null, best.evidence)
        last = self._fit_random_effects(explained.final, [best.effect])
        return (replace(explained, random_effects=tuple(last)), runner) if last else None

    def _fit_random_effects(self, base: FitResult, names: Iterable[str]) -> list[VarianceComponent]:
        """Fit the random effects among these on top of a fit; give those that count.

        Outliers are as random as a random effect. It counts only where it shows beside them too.
        """
        tasks = [
            Task(base=base, runs=self.runner.runs, effect=name)
            for name in names
            if self.runner.model.candidates[name].stochastic
        ]
        found = list(self.runner.map(fit_random_effect, tasks))
        beside = (
            self._cleared(self.runner).map(fit_random_effect, tasks) if self.outliers else found
        )
        return [
            one
            for one, other in zip(found, beside, strict=True)
            if one.consistent and min(one.evidence, other.evidence) > EVIDENCE_THRESHOLD
        ]

    def _check_consistency(self, explained: Explanation, decision: Decision) -> Decision:
        """Make the decision unknown where each run agrees with the equations, but not together."""
        runs = self.runner.runs
        if explained.unconverged or len(runs) < 2:
            return decision
        tasks = [Task(base=explained.null, runs=(run,)) for run in runs]
        fits = list(self._cleared(self.runner).map(run_consistency.fit_alone, tasks))
        reason = run_consistency.inconsistency(self.runner.model, runs, fits)
        return replace(decision, kind="unknown", effects=(), reason=reason) if reason else decision
