"""One diagnosis from the contest to the answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from plant_emulator.diagnosis.calibration.confidence import confidence
from plant_emulator.diagnosis.design.next_experiment import Advice
from plant_emulator.diagnosis.execution.pool import model_of
from plant_emulator.diagnosis.execution.progress import Told
from plant_emulator.diagnosis.fitting.derived_quantities import in_terms
from plant_emulator.diagnosis.fitting.evidence import NOISE_LEFT, THRESHOLD
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.prediction import gap
from plant_emulator.diagnosis.prediction.held_out import NOMINAL, HeldOut
from plant_emulator.diagnosis.prediction.remainder import rest_of
from plant_emulator.diagnosis.report import answer as parts
from plant_emulator.diagnosis.report.details import Details
from plant_emulator.diagnosis.selection import subsystem, verdict
from plant_emulator.diagnosis.selection.procedure import Inquiry
from plant_emulator.diagnosis.selection.rules import SECOND

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.calibration.confidence import Case
    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.execution.progress import Progress
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Contender, Explanation
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.prediction.gap import Gap, Prediction
    from plant_emulator.diagnosis.prediction.held_out import Plan
    from plant_emulator.diagnosis.selection.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The answer, what a report shows beside it, and the values to save.

    fixed : of every accepted effect the values that were not fitted, by name in the effect
    """

    answer: dict[str, Any]
    details: Details
    final: FitResult
    fixed: Mapping[str, Mapping[str, float]]


# Of the contest, as the report tells them.
THRESHOLDS = {
    "evidence that an effect needs": f"{THRESHOLD:g}",
    "evidence that a second one needs": f"{SECOND:g}",
    "mean square over the noise up to which a fit leaves noise": f"{NOISE_LEFT:g}",
}


class Diagnose:
    """The steps from a plan to a diagnosis.

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
        self.pool = pool if progress is None else Told(pool, progress)
        self.recipe, self.plan = recipe, plan
        self.model: Model = model_of(recipe)
        self.settings, self.notes = settings, tuple(notes)
        self.cases = None if cases is None else tuple(cases)
        self.law_errors = law_errors or {}
        self.folds, self.predictable = plan.folds, True

    def diagnose(self) -> Diagnosis:
        """Contest, verdict, held-out runs, place."""
        inquiry = Inquiry(
            pool=self.pool,
            recipe=self.recipe,
            model=self.model,
            runs=self.plan.fitted,
        )
        inquiry = inquiry.with_quiet_inputs()
        explained, found, quiet = inquiry.found()
        held_out = HeldOut(
            pool=self.pool,
            recipe=self.recipe,
            model=self.model,
            plan=self.plan,
        )
        followed = _followed(explained, found)
        usable, notes = held_out.usable(explained, followed)
        self.notes += notes
        # Where nothing can be predicted with the effects, all runs show what is left without them.
        self.folds, self.predictable = usable or self.plan.folds, bool(usable)
        predicted = held_out.predictions(explained, followed, self.folds)
        self.notes += held_out.unsettled(self.folds, predicted)
        return self._answered(explained, found, predicted, quiet)

    def _answered(
        self,
        explained: Explanation,
        found: Verdict,
        predicted: Mapping[tuple[str, ...], list[Prediction]],
        quiet: Recipe,
    ) -> Diagnosis:
        runs = [self.model.runs[run] for _, some in self.folds for run in some]
        lengths = gap.block_lengths(predicted[()])
        gaps = {key: gap.gap(runs, some, lengths) for key, some in predicted.items()}
        location, maps = self._location(explained, found)
        final = parts.with_chance(explained) if found.effects else explained.null
        followed = _followed(explained, found)
        traces = parts.traces(runs, predicted[()], predicted[followed])
        terms = in_terms(self.model, final, self.plan.fitted)
        rest = None
        if not self.model.reaches_noise:
            rest = rest_of(self.model, final, self.plan.fitted, traces)
        closed, interval = self._closed(found, followed, gaps)
        hidden = parts.undetectable(explained, self.model.candidates)
        advice = Advice(self.pool, quiet, self.model, self.plan.fitted)
        answer = {
            "schema": "gap-diagnosis/1",
            "logs": {
                "estimation": [self.model.runs[k].source for k in self.plan.fitted],
                "held_out": list(dict.fromkeys(run.source for run in runs)),
            },
            "verdict": verdict.as_answer(
                found,
                classes=explained.classes(),
                confidence=self._confidence(explained, found),
                sentence=verdict.statement(
                    found,
                    self.model.candidates,
                    closed,
                    location["subsystem"],
                    terms=terms,
                    rest=rest,
                ),
                next_experiment=advice.next_experiment(
                    explained, found, location, [entry["effect"] for entry in hidden]
                ),
            ),
            "location": location,
            "gap": {
                "nominal": parts.ranged(gaps[NOMINAL], runs),
                "recalibrated": parts.ranged(gaps[()], runs),
                "explained": parts.ranged(gaps[followed], runs),
                "noise_floor": parts.noise_floor(gaps[()], runs),
                "closed_fraction": closed,
                "closed_fraction_ci95": interval,
            },
            "ranking": [
                self._rank(c, explained, found, gaps, terms) for c in parts.ranked(explained)
            ],
            "undetectable": hidden,
        }
        details = Details(
            traces=traces,
            waterfall=parts.waterfall(gaps, followed),
            settings={**self.settings, **THRESHOLDS},
            notes=self.notes,
            rest=rest,
            maps=maps,
        )
        return Diagnosis(
            answer=answer,
            details=details,
            final=final,
            fixed={name: self._fixed(name) for name in found.effects},
        )

    def _fixed(self, name: str) -> dict[str, float]:
        fixed = self.model.candidates[name].fixed
        return {key.removeprefix(f"{name}_"): value for key, value in fixed.items()}

    def _location(
        self, explained: Explanation, found: Verdict
    ) -> tuple[dict[str, Any], Mapping[str, Any]]:
        """The answer's location, and the residual map by axis."""
        task = Task(base=explained.null, runs=self.plan.fitted)
        (located,) = self.pool.map(subsystem.site, self.recipe, [task])
        shares = subsystem.evidence_shares(explained, self.model.candidates)
        if located is not None:
            shares = {entry["name"]: entry["share"] for entry in located["subsystems"]}
        where = subsystem.subsystem(found, self.model.candidates, shares)
        maps = {} if located is None else located["maps"]
        return subsystem.location(where, shares, located), maps

    def _closed(
        self, found: Verdict, followed: tuple[str, ...], gaps: Mapping[tuple[str, ...], Gap]
    ) -> tuple[float | None, list[float] | None]:
        """The closed fraction with its interval, where the verdict names a cause.

        None where the cause is chance alone: nothing predicts its course; and where no held-out run
        can be predicted with it.
        """
        if not self.predictable:
            return None, None
        if found.kind not in {"effect", "parameter"} or (found.effects and not followed):
            return None, None
        reference = gaps[NOMINAL] if found.kind == "parameter" else gaps[()]
        interval = gap.interval(reference, gaps[followed])
        closed = gap.closed_fraction(reference, gaps[followed])
        return closed, None if interval is None else list(interval)

    def _rank(
        self,
        contender: Contender,
        explained: Explanation,
        found: Verdict,
        gaps: Mapping[tuple[str, ...], Gap],
        terms: Mapping[str, list[dict[str, Any]]],
    ) -> dict[str, Any]:
        alone = gaps.get((contender.effect,))
        gain = None if alone is None else gap.closed_fraction(gaps[()], alone)
        candidate = self.model.candidates[contender.effect]
        errors = self.law_errors
        entry = parts.rank(contender, explained, found.effects, candidate, gain, errors)
        entry["parameters"] += terms.get(contender.effect, [])
        return entry

    def _confidence(self, explained: Explanation, found: Verdict) -> float | None:
        if self.cases is None:
            return None
        return confidence(self.cases, found.kind, self._evidence(explained, found))

    def _evidence(self, explained: Explanation, found: Verdict) -> float:
        """Evidence of the weakest effect that is named; of the best one where none is."""
        by_name = {c.effect: explained.evidence(c) for c in explained.contenders}
        named = [by_name[name] for name in found.effects]
        return min(named) if named else max(by_name.values(), default=0.0)


def _followed(explained: Explanation, found: Verdict) -> tuple[str, ...]:
    """The effects named that a simulation can follow."""
    return explained.final.effects if found.effects else ()
