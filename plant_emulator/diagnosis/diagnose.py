"""One diagnosis, from a plan of runs to the findings.

1. The procedure tests the hypotheses and decides (`decision.procedure`). Effects whose size is
   uncertain lose their names (`decision.verdict`).
2. The held-out runs are predicted with every hypothesis that counts (`prediction.held_out`).
3. The gap is located (`decision.subsystem`).
4. The answer and the details of the report are put together (`report`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import Answer, Logs
from plant_emulator.diagnosis.calibration.confidence import Standing, confidence
from plant_emulator.diagnosis.decision import subsystem
from plant_emulator.diagnosis.decision.procedure import Procedure
from plant_emulator.diagnosis.decision.verdict import without_uncertain
from plant_emulator.diagnosis.design.next_experiment import Advice
from plant_emulator.diagnosis.execution.pool import InProcess, TaskRunner, build_model
from plant_emulator.diagnosis.execution.progress import ReportingPool
from plant_emulator.diagnosis.fitting.evidence import (
    LARGEST_SHARE,
    NOISE_MEAN_SQUARE,
    UNEXPLAINED_SHARE,
)
from plant_emulator.diagnosis.fitting.fit_steps import simulate_once
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.noise.sensor_noise import sensor_noise
from plant_emulator.diagnosis.noise.spectra import spectra
from plant_emulator.diagnosis.prediction.gap import shows_shrinkage
from plant_emulator.diagnosis.prediction.held_out import HeldOutRuns
from plant_emulator.diagnosis.report.details import Details
from plant_emulator.diagnosis.report.ranking import (
    hypotheses_to_rank,
    ranked_effect,
    undetectable,
    with_random_effects,
)
from plant_emulator.diagnosis.report.shrinkage import held_out_gap, waterfall
from plant_emulator.diagnosis.report.statement import statement, verdict
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import (
        HeldOutGap,
        Location,
        RankedEffect,
        Undetectable,
        Verdict,
    )
    from plant_emulator.diagnosis.calibration.confidence import TrialVerdict
    from plant_emulator.diagnosis.decision.verdict import Decision
    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.execution.progress import Progress
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation, Hypothesis
    from plant_emulator.diagnosis.noise.spectra import Spectrum
    from plant_emulator.diagnosis.prediction.gap import Gap
    from plant_emulator.diagnosis.prediction.held_out import Gaps, Plan

# Thresholds of the hypothesis tests, for the report.
THRESHOLDS = {
    "gain of log evidence that an effect needs": f"{SETTINGS.needed:g}",
    "gain that one more effect needs": f"{SETTINGS.needed_again:g}",
    "share of what a set explains that one more effect must gain": f"{SETTINGS.law_error_along:g}",
    "share of the gap that named effects may leave": f"{UNEXPLAINED_SHARE:g}",
    "share of the gap that an effect explains, beside which another one is sought": (
        f"{LARGEST_SHARE:.2g}"
    ),
    "mean square over the noise up to which a fit leaves noise": f"{NOISE_MEAN_SQUARE:g}",
}

UNCERTAIN = "the fit has it, but it is not named: its size is smaller than its own error"


@dataclass(frozen=True, kw_only=True)
class Findings:
    """The findings of a diagnosis.

    details : what a report shows beside the answer
    final : fit whose values can be saved
    fixed : for each effect of that fit the values that were not fitted, by name in the effect
    """

    answer: Answer
    details: Details
    final: FitResult
    fixed: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, kw_only=True)
class _Tests:
    """The tested hypotheses; runner : in whose noise their costs count."""

    explained: Explanation
    decision: Decision
    runner: TaskRunner

    @property
    def effects(self) -> tuple[str, ...]:
        """The accepted effects that a simulation can follow."""
        return self.explained.final.effects if self.decision.effects else ()

    @property
    def fitted(self) -> tuple[str, ...]:
        """The effects of the final fit, with the random ones; the accepted ones come first."""
        return tuple(dict.fromkeys((*self.decision.effects, *self.effects)))

    @property
    def notes(self) -> tuple[str, ...]:
        """A note on each effect that was fitted and is not named."""
        unnamed = [name for name in self.fitted if name not in self.decision.effects]
        return tuple(f"{name}: {UNCERTAIN}" for name in unnamed)

    @property
    def final(self) -> FitResult:
        """The fit with the accepted effects, the random ones included."""
        return with_random_effects(self.explained) if self.decision.effects else self.explained.null

    @property
    def standing(self) -> Standing:
        """How the decision stands among the hypotheses."""
        return Standing(kind=self.decision.kind, log_odds=self.explained.log_odds)

    def reference(self, gaps: Gaps) -> Gap | None:
        """The gap that the decision closes a share of.

        None: the decision names no cause, no run can be predicted with it, or nothing predicts the
        course of a random effect, which is the cause or hides what the others close.
        """
        if not gaps.predictable or (self.decision.effects and not self.effects):
            return None
        random = self.explained.random_effects and self.effects
        if random and not shows_shrinkage(gaps.null, gaps.by_effects[self.effects]):
            return None
        return {"parameter": gaps.nominal, "effect": gaps.null}.get(self.decision.kind)

    def confirm(self, gaps: Gaps) -> _Tests:
        """The tests; with an unknown cause where the held-out runs do not confirm the effects."""
        reference = self.reference(gaps)
        if not self.effects or reference is None:
            return self
        if shows_shrinkage(reference, gaps.by_effects[self.effects]):
            return self
        reason = f"the held-out runs do not confirm {' and '.join(self.effects)}"
        return replace(
            self, decision=replace(self.decision, kind="unknown", effects=(), reason=reason)
        )


class Diagnose:
    """The steps from a plan to the findings of a diagnosis.

    settings : lines for the report on how to repeat the diagnosis, by name
    cases : of a blind trial, for the confidence; None: there are none of this machine
    model_form_errors : relative, of the sizes by name; see `calibration.model_form_error`
    notes : on the logs, for the report
    progress : called with the label of each step and its done share [1]
    """

    def __init__(
        self,
        pool: Pool,
        recipe: Recipe,
        plan: Plan,
        *,
        settings: Mapping[str, str],
        cases: Sequence[TrialVerdict] | None = None,
        model_form_errors: Mapping[str, float] | None = None,
        notes: Sequence[str] = (),
        progress: Progress | None = None,
    ) -> None:
        def reporting(pool: Pool) -> Pool:
            return pool if progress is None else ReportingPool(pool, progress)

        self.runner = TaskRunner(
            pool=reporting(pool), recipe=recipe, model=build_model(recipe), runs=plan.fitted
        )
        self._here = replace(self.runner, pool=reporting(InProcess()))
        self.model, self.plan = self.runner.model, plan
        self.settings, self.notes = settings, tuple(notes)
        self.cases = None if cases is None else tuple(cases)
        self.model_form_errors = model_form_errors or {}

    def diagnose(self) -> Findings:
        """Test the hypotheses, predict the held-out runs, locate the gap; give the findings."""
        # Nobody waits for it: the pool loads its code while this process makes the first fit.
        self.runner.map(simulate_once, self.plan.fitted)
        tests = self._test()
        # Asked for first, so that it is looked for beside the predictions.
        located = self.runner.map(
            subsystem.locate_gap, [Task(base=tests.explained.null, runs=self.plan.fitted)]
        )
        gaps = HeldOutRuns(runner=tests.runner, plan=self.plan).gaps(tests.explained, tests.effects)
        tests = tests.confirm(gaps)
        return Findings(
            answer=self._answer(tests, gaps, next(located)),
            details=Details(
                traces=gaps.traces(tests.effects),
                waterfall=waterfall(gaps.by_effects, tests.effects),
                settings={**self.settings, **THRESHOLDS},
                notes=(*self.notes, *gaps.notes, *tests.notes),
                spectra=self._spectra(tests),
            ),
            final=tests.final,
            fixed={name: self._fixed_values(name) for name in tests.fitted},
        )

    def _test(self) -> _Tests:
        procedure = replace(Procedure.begin(self._here), runner=self.runner)
        procedure = procedure.with_input_noise().with_disturbances()
        explained, decision, runner = procedure.run()
        explained, decision = without_uncertain(
            self.model, explained, decision, self.model_form_errors
        )
        return _Tests(explained=explained, decision=decision, runner=runner)

    def _spectra(self, tests: _Tests) -> tuple[Spectrum, ...]:
        """Spectra of the channels, with their noise."""
        model, explained = build_model(tests.runner.recipe), tests.explained
        return spectra(model, explained.final, self.plan.fitted, explained.noise)

    def _answer(self, tests: _Tests, gaps: Gaps, located: Location | None) -> Answer:
        location = self._location(tests, located)
        reference = tests.reference(gaps)
        gap = held_out_gap(gaps.by_effects, gaps.runs, tests.effects, reference, gaps.fitted)
        hidden = undetectable(tests.explained, self.model.candidates)
        return Answer(
            logs=Logs(
                estimation=tuple(self.model.runs[k].source for k in self.plan.fitted),
                held_out=tuple(dict.fromkeys(run.source for run in gaps.runs)),
            ),
            verdict=self._verdict(tests, gap, location, hidden),
            location=location,
            gap=gap,
            ranking=tuple(
                self._rank(one, tests, gaps.gain(one.effect))
                for one in hypotheses_to_rank(tests.explained)
            ),
            undetectable=hidden,
            trace=tests.explained.trace,
            noise=sensor_noise(self.model.runs, tests.explained.noise),
        )

    def _verdict(
        self,
        tests: _Tests,
        gap: HeldOutGap,
        location: Location,
        hidden: Sequence[Undetectable],
    ) -> Verdict:
        sentence = statement(
            tests.decision,
            self.model.candidates,
            gap.closed_fraction,
            location.subsystem,
        )
        standing = tests.standing
        next_experiment = Advice(runner=tests.runner).next_experiment(
            tests.explained, tests.decision, location, [one.effect for one in hidden]
        )
        return verdict(
            tests.decision,
            classes=tests.explained.classes(),
            confidence=None if self.cases is None else confidence(self.cases, standing),
            standing=standing,
            sentence=sentence,
            next_experiment=next_experiment,
        )

    def _location(self, tests: _Tests, located: Location | None) -> Location:
        if located is None:
            shares = subsystem.evidence_shares(tests.explained, self.model.candidates)
        else:
            shares = dict(located.shares)
        faulty = subsystem.faulty_subsystem(tests.decision, self.model.candidates, shares)
        return subsystem.location(faulty, shares, located)

    def _rank(
        self,
        hypothesis: Hypothesis,
        tests: _Tests,
        gain: float | None,
    ) -> RankedEffect:
        return ranked_effect(
            hypothesis,
            tests.explained,
            tests.decision.effects,
            self.model.candidates[hypothesis.effect],
            gain=gain,
            model_form_errors=self.model_form_errors,
        )

    def _fixed_values(self, name: str) -> dict[str, float]:
        fixed = self.model.candidates[name].fixed
        return {key.removeprefix(f"{name}_"): value for key, value in fixed.items()}
