"""The diagnosis procedure: from the logs to a decision.

1. The noise of measured inputs (`fitting.input_noise_model`) and the lines of the mains are made
   part of the noise, and the outliers are left out (`search.logged_noise`).
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
from plant_emulator.diagnosis.fitting.evidence import (
    EVIDENCE_THRESHOLD,
    adequate,
    leaves_random,
)
from plant_emulator.diagnosis.fitting.fit_steps import refit, start
from plant_emulator.diagnosis.fitting.input_noise_model import whiten_inputs
from plant_emulator.diagnosis.fitting.random_effects import WeightedRecipe, fit_random_effect
from plant_emulator.diagnosis.fitting.regularity import find_regularities
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.logged_noise import (
    WhitenedRecipe,
    estimate_noise,
    find_disturbances,
)
from plant_emulator.diagnosis.search.search import Search
from plant_emulator.diagnosis.search.summary import not_told_apart

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from plant_emulator.diagnosis.decision.verdict import Decision
    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult, VarianceComponent
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.estimation.noise.logged_noise import LoggedNoise


@dataclass(frozen=True, kw_only=True)
class _Tested:
    """The tested hypotheses, and the noise in which their costs count.

    runner : whose model has that noise; estimated : the noise, where the search estimated it
    instead : sets that explain the gap in the place of the random effect that they were found
        beside, where it shows no longer
    """

    explained: Explanation
    runner: TaskRunner
    estimated: LoggedNoise | None = None
    instead: Sequence[FitResult] = ()

    @property
    def random(self) -> bool:
        """Whether a random effect is part of what explains the gap."""
        return bool(self.explained.random_effects)


@dataclass(frozen=True, kw_only=True)
class Procedure:
    """One diagnosis up to its decision.

    null : fit without effects
    led : the best fit along the measured outputs on the way to it; None: none was needed
    disturbances : lines of the mains, and the outliers, which are left out; None: there are none
    """

    runner: TaskRunner
    null: FitResult
    led: FitResult | None = None
    disturbances: LoggedNoise | None = None

    @classmethod
    def begin(cls, runner: TaskRunner) -> Procedure:
        """The procedure with the fit without effects."""
        ((null, led),) = runner.map(start, [runner.runs])
        return cls(runner=runner, null=null, led=led)

    def with_input_noise(self) -> Procedure:
        """Give the procedure with the noise of measured inputs as part of the noise."""
        runner, null = whiten_inputs(self.runner, self.null)
        return replace(self, runner=runner, null=null)

    def with_disturbances(self) -> Procedure:
        """Give the procedure with the disturbances that the fit without effects leaves."""
        runs, null = self.runner.runs, self.null
        ((lines, found),) = self.runner.map(find_disturbances, [Task(base=null, runs=runs)])
        if lines is not None:
            (null,) = _whitened(self.runner, lines).map(refit, [Task(base=null, runs=runs)])
        return replace(self, null=null, disturbances=found)

    def run(self) -> tuple[Explanation, Decision, TaskRunner]:
        """Test the hypotheses and decide; give also the runner in whose noise the costs count."""
        model, null = self.runner.model, self.null
        found = self._test_random_gap(null)
        if not (found and found.random) or decide(model, found.explained).kind == "unknown":
            plain = self._test_effects(null, found.instead if found else ())
            if not (found and found.random) or decide(model, plain.explained).kind != "unknown":
                found = plain
        explained = found.explained
        left = decide(model, explained).kind == "unknown" or leaves_random(explained.final)
        if left and not explained.random_effects:
            beside = self._test_random_effects(explained.final, found)
            known = decide(model, explained).kind != "unknown"
            unknown = beside is None or decide(model, beside.explained).kind == "unknown"
            if beside and beside.random and not (known and unknown):
                found = beside
        explained, runner = found.explained, found.runner
        decision = decide(model, explained)
        # Runs that agree together, but for a regularity, need no test.
        if decide(model, replace(explained, regularities=())).kind == "unknown":
            decision = self._check_consistency(explained, decision)
        return explained, decision, runner

    def _test_effects(self, null: FitResult, known: Sequence[FitResult]) -> _Tested:
        """Search the library; known : sets to begin with, as they are in another noise."""
        runner = self._cleared
        if self.disturbances is not None:
            (null,) = runner.map(refit, [Task(base=null, runs=runner.runs)])
        fits = list(runner.map(refit, [Task(base=one, runs=runner.runs) for one in known]))
        nulls = [null, *(one for one in fits if not one.effects)]
        search = Search(
            declared=self.runner,
            runner=runner,
            null=min(nulls, key=lambda one: one.cost),
            led_null=self.led,
            sets={frozenset(one.effects): one for one in fits},
            noise=self.disturbances,
        )
        explained = search.explain()
        return _Tested(
            explained=_with_regularities(explained, search.runner),
            runner=search.runner,
            estimated=None if search.noise is self.disturbances else search.noise,
        )

    @property
    def _cleared(self) -> TaskRunner:
        """A runner whose model leaves the outliers out as well."""
        return _whitened(self.runner, self.disturbances)

    def _test_random_gap(self, null: FitResult) -> _Tested | None:
        """Test the random effects first where the gap is large and random.

        None: the gap is small or not random
        """
        return self._test_random_effects(null) if leaves_random(null) else None

    def _test_random_effects(
        self, base: FitResult, beside: _Tested | None = None
    ) -> _Tested | None:
        """Test all effects with the best random effect as part of the noise.

        base : fit whose residual shows the random effect
        beside : hypotheses whose noise the random effect shows beside, where it was estimated;
            None: the declared noise, or that around the base where it leaves a colour
        None: no random effect explains the residual. The one that does may show no longer beside
        the effects that are found
        """
        noise = (None if beside is None else beside.estimated) or self.disturbances
        plain = _whitened(self.runner, noise)
        found = self._fit_random_effects(plain, base, plain.model.candidates)
        if beside is None and any(one.coloured for one in found):
            # The noise may have that colour.
            (noise,) = self.runner.map(estimate_noise, [Task(base=base, runs=plain.runs)])
            plain = _whitened(self.runner, noise)
            found = self._fit_random_effects(plain, base, plain.model.candidates)
        runner, name = _weighted(plain, found)
        if not name:
            return None
        # Beside a random effect outliers stand out that its large residuals hid before.
        (shown,) = runner.map(refit, [Task(base=base, runs=runner.runs)])
        ((_, hidden),) = runner.map(find_disturbances, [Task(base=shown, runs=runner.runs)])
        if hidden is not None:
            noise = hidden if noise is None else noise.with_outliers_of(hidden)
            plain = _whitened(self.runner, noise)
            found = self._fit_random_effects(plain, base, plain.model.candidates)
            runner, name = _weighted(plain, found)
            if not name:
                return None
        # The search begins with the fit that showed the random effect, too: it may be far from the
        # other one.
        known = {(): base if beside is None else beside.explained.null, base.effects: base}
        fits = runner.map(refit, [Task(base=one, runs=runner.runs) for one in known.values()])
        sets = {frozenset(one.effects): one for one in fits}
        search = Search(
            declared=runner,
            runner=runner,
            null=sets[frozenset()],
            led_null=self.led,
            sets=sets,
            beside_random=True,
            noise=noise,
        )
        explained = search.explain()
        last = self._fit_random_effects(plain, explained.final, [name])
        if not any(one.consistent for one in last):
            enough = explained.final.effects and adequate(explained.final, explained.null)
            instead = not_told_apart(search.unrefuted) if enough else ()
            return _Tested(explained=explained, runner=runner, instead=instead)
        explained = replace(explained, random_effects=tuple(last))
        return _Tested(explained=_with_regularities(explained, runner), runner=runner)

    def _fit_random_effects(
        self, runner: TaskRunner, base: FitResult, names: Iterable[str]
    ) -> list[VarianceComponent]:
        """Fit the random effects among these on top of a fit; give those of enough evidence."""
        library = self.runner.model.candidates
        tasks = [
            Task(base=base, runs=runner.runs, effect=name)
            for name in names
            if library[name].stochastic
        ]
        return [
            one for one in runner.map(fit_random_effect, tasks) if one.evidence > EVIDENCE_THRESHOLD
        ]

    def _check_consistency(self, explained: Explanation, decision: Decision) -> Decision:
        """Make the decision unknown where each run agrees with the equations, but not together."""
        runs = self.runner.runs
        if explained.unconverged or len(runs) < 2:
            return decision
        tasks = [Task(base=explained.null, runs=(run,)) for run in runs]
        fits = list(self._cleared.map(run_consistency.fit_alone, tasks))
        reason = run_consistency.inconsistency(self.runner.model, runs, fits)
        return replace(decision, kind="unknown", effects=(), reason=reason) if reason else decision


def _with_regularities(explained: Explanation, runner: TaskRunner) -> Explanation:
    """The explanation with the regularities of what it leaves in the noise of the runner.

    A random effect explains none: its course is chance.
    """
    (found,) = runner.map(find_regularities, [Task(base=explained.final, runs=runner.runs)])
    return replace(explained, regularities=found)


def _weighted(plain: TaskRunner, found: Iterable[VarianceComponent]) -> tuple[TaskRunner, str]:
    """The runner with the best random effect that counts as part of the noise, and its name.

    Without one, the runner is as given and the name is empty.
    """
    counting = (one for one in found if one.consistent)
    best = max(counting, key=lambda one: one.evidence, default=None)
    if best is None:
        return plain, ""
    weights = dict(zip(plain.runs, best.weights, strict=True))
    every = tuple(weights.get(k, np.ones(1)) for k in range(len(plain.model.runs)))
    return replace(plain, recipe=WeightedRecipe(plain.recipe, every)), best.effect


def _whitened(runner: TaskRunner, noise: LoggedNoise | None) -> TaskRunner:
    """A runner whose model is whitened for this noise."""
    return runner if noise is None else replace(runner, recipe=WhitenedRecipe(runner.recipe, noise))
