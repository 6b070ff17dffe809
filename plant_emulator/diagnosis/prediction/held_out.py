"""The held-out runs: which can be predicted, and what each hypothesis leaves there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import (
    DETECTABLE_NORM,
    EVIDENCE_THRESHOLD,
    NOISE_MEAN_SQUARE,
)
from plant_emulator.diagnosis.prediction.gap import (
    Fold,
    block_lengths,
    closed_fraction,
    measure_gap,
    predict,
    signature_norms,
    tells_share,
)
from plant_emulator.diagnosis.prediction.trace import traces

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation, Hypothesis
    from plant_emulator.diagnosis.machine import MeasuredRun
    from plant_emulator.diagnosis.prediction.gap import Gap, Prediction
    from plant_emulator.diagnosis.prediction.trace import Trace

    # Predictions of each hypothesis, by its effects, one a fold.
    Predictions = Mapping[tuple[str, ...], Sequence[Prediction]]

# At most so many effects are predicted beside the accepted ones: each takes a fit a fold.
MOST_PREDICTED = 3
# Share of the best effect's evidence that an effect needs to be predicted. With less it is no
# alternative, and its fits stop in local minima, so that its gain would tell of these.
COMPARABLE_EVIDENCE = 0.5
NO_SHARE = (
    "no share is told: the other runs leave open how much of a held-out run the effects close"
)
# Stands for the parameter set as given among the hypotheses, which are named by their effects.
NOMINAL = ("nominal",)
# Of every fold the fitted runs, and the predicted runs.
Folds = tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The runs of the model that are fitted, and those that are predicted.

    fitted : runs of the diagnosis itself
    folds : fitted and predicted runs of each cross-validation fold
    as_fitted : whether the predicted run is a later part of the fitted one, and starts as that does
    """

    fitted: tuple[int, ...]
    folds: Folds
    as_fitted: bool = False


@dataclass(frozen=True, kw_only=True)
class Gaps:
    """The held-out gaps of the hypotheses.

    runs : the predicted runs
    predictions, by_effects : predictions and gap of each hypothesis, by its effects or NOMINAL
    predictable : whether any run can be predicted with the accepted effects, well enough to tell
        a share
    notes : on folds without a prediction and fits that did not converge
    fitted : gap that the fit to all runs leaves with the accepted effects on the same runs; None:
        it is what the predictions belong to
    """

    runs: Sequence[MeasuredRun]
    predictions: Predictions
    by_effects: Mapping[tuple[str, ...], Gap]
    predictable: bool
    notes: tuple[str, ...]
    fitted: Gap | None = None

    @property
    def nominal(self) -> Gap:
        """The gap with the nominal parameters."""
        return self.by_effects[NOMINAL]

    @property
    def null(self) -> Gap:
        """The gap without effects."""
        return self.by_effects[()]

    def gain(self, effect: str) -> float | None:
        """Closed fraction with this effect alone [1]; None where it was not predicted."""
        alone = self.by_effects.get((effect,))
        return None if alone is None else closed_fraction(self.null, alone)

    def traces(self, effects: tuple[str, ...]) -> tuple[Trace, ...]:
        """Traces of the predicted runs, without and with these effects."""
        return traces(self.runs, self.predictions[()], self.predictions[effects])


@dataclass(frozen=True, kw_only=True)
class HeldOutRuns:
    """The held-out runs of one diagnosis."""

    runner: TaskRunner
    plan: Plan

    def gaps(self, explained: Explanation, followed: tuple[str, ...]) -> Gaps:
        """Predict the held-out runs with every hypothesis that counts, and measure the gaps.

        followed : accepted effects that a simulation can follow
        Where no run can be predicted with them, all runs show the gap without them.
        """
        usable, notes = self.usable_folds(explained, followed)
        folds = usable or self.plan.folds
        predictions = self.predictions(explained, followed, folds)
        runs = [self.runner.model.runs[run] for _, predicted in folds for run in predicted]
        lengths = block_lengths(predictions[()])
        by_effects = {key: measure_gap(runs, one, lengths) for key, one in predictions.items()}
        faint = explained.null.mean_square <= NOISE_MEAN_SQUARE
        told = not followed or tells_share(by_effects[()], by_effects[followed], faint=faint)
        return Gaps(
            runs=runs,
            predictions=predictions,
            by_effects=by_effects,
            predictable=bool(usable) and told,
            notes=(
                *notes,
                *self.convergence_notes(folds, predictions),
                *([] if told else [NO_SHARE]),
            ),
            fitted=self._fitted_gap(explained, followed, folds, lengths),
        )

    def _fitted_gap(
        self,
        explained: Explanation,
        followed: tuple[str, ...],
        folds: Folds,
        lengths: Sequence[int],
    ) -> Gap | None:
        """Gap that the fit leaves on the predicted runs; None: it did not see all of them."""
        found = explained.final if followed else explained.null
        runs = [run for _, predicted in folds for run in predicted]
        if not set(runs) <= set(self.plan.fitted):
            return None
        alone = [
            replace(self._fold(found, (run,), (run,), refitted=False), as_fitted=True)
            for run in runs
        ]
        predictions = list(self.runner.map(predict, alone))
        return measure_gap([self.runner.model.runs[run] for run in runs], predictions, lengths)

    def usable_folds(
        self, explained: Explanation, followed: tuple[str, ...]
    ) -> tuple[Folds, tuple[str, ...]]:
        """Folds whose fitted runs show all these effects, and a note on each other fold.

        Runs that do not show an effect cannot predict it, so that no fold may be left.
        """
        folds = self.plan.folds
        norms: Iterable[Mapping[str, float]] = [{} for _ in folds]
        if followed and len(folds) > 1:
            tasks = [self._fold(explained.final, *fold, refitted=False) for fold in folds]
            norms = self.runner.map(signature_norms, tasks)
        usable, notes = [], []
        for (fitted, predicted), own in zip(folds, norms, strict=True):
            weak = [name for name, norm in own.items() if norm < DETECTABLE_NORM]
            unseen = [*weak, *(n for n in followed if all(n in self._hides(k) for k in fitted))]
            telling = tuple(k for k in predicted if not self._hides(k) & set(followed))
            if unseen:
                lost = self._sources(predicted)
                notes.append(f"{lost}: shows no shrinkage; the other runs do not show {unseen[0]}")
                continue
            if telling != predicted:
                lost = self._sources([k for k in predicted if k not in telling])
                notes.append(
                    f"{lost}: shows no shrinkage; it does not show {' and '.join(followed)}"
                )
            if telling:
                usable.append((fitted, telling))
        return tuple(usable), tuple(notes)

    def _hides(self, run: int) -> frozenset[str]:
        """Effects that a run cannot show."""
        return self.runner.model.runs[run].hides

    def predictions(
        self, explained: Explanation, followed: tuple[str, ...], folds: Folds
    ) -> dict[tuple[str, ...], list[Prediction]]:
        """Held-out residuals of every hypothesis by its effects, one prediction a fold.

        NOMINAL : the nominal parameters, or those that the fold's own runs tell
        """
        keys, tasks = [], []
        for key, found in _hypotheses(explained, followed):
            for fitted, predicted in folds:
                start = found
                if key == NOMINAL:
                    start = replace(found, values=self.runner.model.nominal(fitted))
                keys.append(key)
                fold = self._fold(start, fitted, predicted, refitted=key != NOMINAL)
                # States that suit the fitted parameters do not suit others.
                tasks.append(replace(fold, states=()) if key == NOMINAL else fold)
        predictions: dict[tuple[str, ...], list[Prediction]] = {}
        for key, prediction in zip(keys, self.runner.map(predict, tasks), strict=True):
            predictions.setdefault(key, []).append(prediction)
        return predictions

    def convergence_notes(self, folds: Folds, predictions: Predictions) -> tuple[str, ...]:
        """A note on each hypothesis whose fit for a held-out run did not converge."""
        notes = []
        for key, found in predictions.items():
            pairs = zip(folds, found, strict=True)
            runs = [run for (_, some), one in pairs if not one.converged for run in some]
            if runs:
                those = ", ".join(key) or "no effect"
                sources = self._sources(runs)
                notes.append(f"{sources}: predicted by a fit with {those} that did not end")
        return tuple(notes)

    def _sources(self, runs: Sequence[int]) -> str:
        return ", ".join(self.runner.model.runs[run].source for run in runs)

    def _fold(
        self,
        start: FitResult,
        fitted: tuple[int, ...],
        predicted: tuple[int, ...],
        *,
        refitted: bool,
    ) -> Fold:
        """A fold that starts from a fit to all runs of the plan."""
        of_runs = dict(zip(self.plan.fitted, start.states, strict=True))
        seen = all(run in of_runs for run in predicted)
        return Fold(
            fitted=fitted,
            predicted=predicted,
            start=start.of_runs([self.plan.fitted.index(run) for run in fitted]),
            states=tuple(of_runs[run] for run in predicted) if seen else (),
            refitted=refitted,
            as_fitted=self.plan.as_fitted,
        )


def _hypotheses(
    explained: Explanation, followed: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], FitResult]]:
    """Fits to predict from, by their effects.

    They are the parameters as given, the fit without effects, the fits with one accepted effect
    after the other, and each comparable effect alone.
    """
    fits: dict[tuple[str, ...], FitResult] = {(): explained.null}
    for count in range(1, len(followed) + 1):
        fits[followed[:count]] = replace(explained.final, effects=followed[:count])
    for hypothesis in _comparable(explained, followed):
        if hypothesis.fit is not None:
            fits.setdefault((hypothesis.effect,), hypothesis.fit)
    yield NOMINAL, explained.null
    yield from fits.items()


def _comparable(explained: Explanation, followed: Sequence[str]) -> list[Hypothesis]:
    """The accepted effects, and those whose evidence counts and comes near the best."""
    fitted = [one for one in explained.hypotheses if one.fit is not None]
    ranked = sorted(fitted, key=explained.evidence, reverse=True)
    shares = [COMPARABLE_EVIDENCE * explained.evidence(one) for one in ranked[:1]]
    least = max([EVIDENCE_THRESHOLD, *shares])
    near = [one for one in ranked[:MOST_PREDICTED] if explained.evidence(one) > least]
    return [one for one in ranked if one in near or one.effect in followed]
