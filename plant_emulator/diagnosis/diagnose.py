"""One diagnosis from the contest to the answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import Answer, Logs
from plant_emulator.diagnosis.calibration.confidence import confidence
from plant_emulator.diagnosis.design.next_experiment import Advice
from plant_emulator.diagnosis.execution.pool import build_model
from plant_emulator.diagnosis.execution.progress import ReportingPool
from plant_emulator.diagnosis.fitting.derived_quantities import in_terms
from plant_emulator.diagnosis.fitting.evidence import EVIDENCE_THRESHOLD, NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.prediction import gap
from plant_emulator.diagnosis.prediction.held_out import NOMINAL, HeldOut
from plant_emulator.diagnosis.prediction.remainder import rest_of
from plant_emulator.diagnosis.prediction.trace import traces
from plant_emulator.diagnosis.report.details import Details
from plant_emulator.diagnosis.report.ranking import rank, ranked, undetectable, with_random_effects
from plant_emulator.diagnosis.report.shrinkage import held_out_gap, waterfall
from plant_emulator.diagnosis.report.statement import statement, verdict
from plant_emulator.diagnosis.selection import subsystem
from plant_emulator.diagnosis.selection.procedure import Procedure
from plant_emulator.diagnosis.selection.rules import SECOND

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import Location, Quantity, RankedEffect
    from plant_emulator.diagnosis.calibration.confidence import Case
    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.execution.progress import Progress
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation, Hypothesis
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.prediction.gap import Gap, Prediction
    from plant_emulator.diagnosis.prediction.held_out import Plan
    from plant_emulator.diagnosis.selection.verdict import Decision


@dataclass(frozen=True, kw_only=True)
class Findings:
    """The answer, what a report shows beside it, and the values to save.

    fixed : of every accepted effect the values that were not fitted, by name in the effect
    """

    answer: Answer
    details: Details
    final: FitResult
    fixed: Mapping[str, Mapping[str, float]]


# Of the contest, as the report tells them.
THRESHOLDS = {
    "evidence that an effect needs": f"{EVIDENCE_THRESHOLD:g}",
    "evidence that a second one needs": f"{SECOND:g}",
    "mean square over the noise up to which a fit leaves noise": f"{NOISE_MEAN_SQUARE:g}",
}


class Diagnose:
    """The steps from a plan to the findings of a diagnosis.

    cases : a blind trial's, for the confidence; None: there are none of this machine
    law_errors : of sizes by name, relative, see `law_error`
    progress : told every step and its done share
    """

    def __init__(
        self,
        pool: Pool,
        recipe: Recipe,
        plan: Plan,
        *,
        settings: Mapping[str, str],
        cases: Sequence[Case] | None = None,
        law_errors: Mapping[str, float] | None = None,
        notes: Sequence[str] = (),
        progress: Progress | None = None,
    ) -> None:
        self.pool = pool if progress is None else ReportingPool(pool, progress)
        self.recipe, self.plan = recipe, plan
        self.model: Model = build_model(recipe)
        self.settings, self.notes = settings, tuple(notes)
        self.cases = None if cases is None else tuple(cases)
        self.law_errors = law_errors or {}
        self.folds, self.predictable = plan.folds, True

    def diagnose(self) -> Findings:
        """Contest, verdict, held-out runs, place."""
        inquiry = Procedure(
            pool=self.pool,
            recipe=self.recipe,
            model=self.model,
            runs=self.plan.fitted,
        )
        inquiry = inquiry.with_quiet_inputs()
        explained, decision, quiet = inquiry.found()
        held_out = HeldOut(
            pool=self.pool,
            recipe=self.recipe,
            model=self.model,
            plan=self.plan,
        )
        followed = _followed(explained, decision)
        usable, notes = held_out.usable(explained, followed)
        self.notes += notes
        # Where nothing can be predicted with the effects, all runs show what is left without them.
        self.folds, self.predictable = usable or self.plan.folds, bool(usable)
        predicted = held_out.predictions(explained, followed, self.folds)
        self.notes += held_out.unsettled(self.folds, predicted)
        return self._findings(explained, decision, predicted, quiet)

    def _findings(
        self,
        explained: Explanation,
        decision: Decision,
        predicted: Mapping[tuple[str, ...], list[Prediction]],
        quiet: Recipe,
    ) -> Findings:
        runs = [self.model.runs[run] for _, some in self.folds for run in some]
        lengths = gap.block_lengths(predicted[()])
        gaps = {key: gap.gap(runs, some, lengths) for key, some in predicted.items()}
        followed = _followed(explained, decision)
        final = with_random_effects(explained) if decision.effects else explained.null
        drawn = traces(runs, predicted[()], predicted[followed])
        rest = None
        if not self.model.reaches_noise:
            rest = rest_of(self.model, final, self.plan.fitted, drawn)
        location = self._location(explained, decision)
        shrinkage = held_out_gap(gaps, runs, followed, self._reference(decision, followed, gaps))
        hidden = undetectable(explained, self.model.candidates)
        terms = in_terms(self.model, final, self.plan.fitted)
        sentence = statement(
            decision,
            self.model.candidates,
            shrinkage.closed_fraction,
            location.subsystem,
            terms=terms,
            rest=rest,
        )
        advice = Advice(self.pool, quiet, self.model, self.plan.fitted)
        answer = Answer(
            logs=Logs(
                estimation=tuple(self.model.runs[k].source for k in self.plan.fitted),
                held_out=tuple(dict.fromkeys(run.source for run in runs)),
            ),
            verdict=verdict(
                decision,
                classes=explained.classes(),
                confidence=self._confidence(explained, decision),
                sentence=sentence,
                next_experiment=advice.next_experiment(
                    explained, decision, location, [one.effect for one in hidden]
                ),
            ),
            location=location,
            gap=shrinkage,
            ranking=tuple(
                self._ranked(c, explained, decision, gaps, terms.get(c.effect, ()))
                for c in ranked(explained)
            ),
            undetectable=hidden,
        )
        details = Details(
            traces=drawn,
            waterfall=waterfall(gaps, followed),
            settings={**self.settings, **THRESHOLDS},
            notes=self.notes,
            rest=rest,
        )
        return Findings(
            answer=answer,
            details=details,
            final=final,
            fixed={name: self._fixed(name) for name in decision.effects},
        )

    def _fixed(self, name: str) -> dict[str, float]:
        fixed = self.model.candidates[name].fixed
        return {key.removeprefix(f"{name}_"): value for key, value in fixed.items()}

    def _location(self, explained: Explanation, decision: Decision) -> Location:
        task = Task(base=explained.null, runs=self.plan.fitted)
        (located,) = self.pool.map(subsystem.site, self.recipe, [task])
        if located is None:
            shares = subsystem.evidence_shares(explained, self.model.candidates)
        else:
            shares = dict(located.shares)
        place = subsystem.subsystem(decision, self.model.candidates, shares)
        return subsystem.location(place, shares, located)

    def _reference(
        self, decision: Decision, followed: tuple[str, ...], gaps: Mapping[tuple[str, ...], Gap]
    ) -> Gap | None:
        """The gap that the verdict closes a share of.

        None: the verdict names no cause, no held-out run can be predicted with it, or the cause is
        chance alone, whose course nothing predicts.
        """
        if not self.predictable or (decision.effects and not followed):
            return None
        return {"parameter": gaps[NOMINAL], "effect": gaps[()]}.get(decision.kind)

    def _ranked(
        self,
        contender: Hypothesis,
        explained: Explanation,
        decision: Decision,
        gaps: Mapping[tuple[str, ...], Gap],
        terms: tuple[Quantity, ...],
    ) -> RankedEffect:
        alone = gaps.get((contender.effect,))
        entry = rank(
            contender,
            explained,
            decision.effects,
            self.model.candidates[contender.effect],
            gain=None if alone is None else gap.closed_fraction(gaps[()], alone),
            law_errors=self.law_errors,
        )
        return replace(entry, parameters=(*entry.parameters, *terms))

    def _confidence(self, explained: Explanation, decision: Decision) -> float | None:
        if self.cases is None:
            return None
        return confidence(self.cases, decision.kind, self._evidence(explained, decision))

    def _evidence(self, explained: Explanation, decision: Decision) -> float:
        """Evidence of the weakest effect that is named; of the best one where none is."""
        by_name = {c.effect: explained.evidence(c) for c in explained.hypotheses}
        named = [by_name[name] for name in decision.effects]
        return min(named) if named else max(by_name.values(), default=0.0)


def _followed(explained: Explanation, decision: Decision) -> tuple[str, ...]:
    """The effects named that a simulation can follow."""
    return explained.final.effects if decision.effects else ()
