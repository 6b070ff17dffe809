"""The runs held out of a diagnosis: which can be predicted, and what every model leaves there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import DETECTABLE_NORM, EVIDENCE_THRESHOLD
from plant_emulator.diagnosis.prediction import gap
from plant_emulator.diagnosis.prediction.gap import Fold

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation, Hypothesis
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.prediction.gap import Prediction

# Effects whose held-out gain is computed beside those accepted: the best ones only, each takes a
# fit a fold.
TRIED = 3
# Share of the best one's evidence that another has at least: with less it is no rival, and its fits
# stop in valleys, so that the share that it closes tells of these.
NEAR = 0.5
# The model "as given" among those that are compared by their effects.
NOMINAL = ("nominal",)
# Of every fold the runs that are fitted, and those that are predicted.
Folds = tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Which runs are fitted and which are predicted; indices of the model's runs.

    folds : (fitted, predicted); with as_fitted the predicted run is a later part of the fitted one
        and starts as that does
    """

    fitted: tuple[int, ...]
    folds: Folds
    as_fitted: bool = False


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """The held-out runs of one diagnosis."""

    pool: Pool
    recipe: Recipe
    model: Model
    plan: Plan

    def usable(
        self, explained: Explanation, followed: tuple[str, ...]
    ) -> tuple[Folds, tuple[str, ...]]:
        """The folds whose fitted runs show all named effects, and a note on every other.

        Runs that do not show an effect cannot predict it. No fold is left where no choice of runs
        shows all.
        """
        tasks = [self._fold(explained.final, *fold, refitted=False) for fold in self.plan.folds]
        if not followed or len(tasks) < 2:
            return self.plan.folds, ()
        usable, notes = [], []
        for fold, norms in zip(
            self.plan.folds, self.pool.map(gap.shown, self.recipe, tasks), strict=True
        ):
            hidden = [name for name, norm in norms.items() if norm < DETECTABLE_NORM]
            if not hidden:
                usable.append(fold)
                continue
            lost = ", ".join(self.model.runs[run].source for run in fold[1])
            notes.append(f"{lost}: shows no shrinkage; the other runs do not show {hidden[0]}")
        return tuple(usable), tuple(notes)

    def predictions(
        self, explained: Explanation, followed: tuple[str, ...], folds: Folds
    ) -> dict[tuple[str, ...], list[Prediction]]:
        """Held-out residuals of every model that is compared, by its effects.

        ("nominal",) : the parameter set as given, or the fold's own where none is.
        """
        points: dict[tuple[str, ...], FitResult] = {(): explained.null}
        for count in range(1, len(followed) + 1):
            some = followed[:count]
            points[some] = replace(explained.final, effects=some)
        for contender in _best(explained, followed):
            assert contender.fit is not None
            points.setdefault((contender.effect,), contender.fit)
        tasks, keys = [], []
        for key, point in [(NOMINAL, explained.null), *points.items()]:
            for fitted, predicted in folds:
                start = point
                if key == NOMINAL:
                    start = replace(point, values=self.model.nominal(fitted))
                keys.append(key)
                tasks.append(self._fold(start, fitted, predicted, refitted=key != NOMINAL))
        found_all: dict[tuple[str, ...], list[Prediction]] = {}
        answers = self.pool.map(gap.predict, self.recipe, tasks)
        for key, prediction in zip(keys, answers, strict=True):
            found_all.setdefault(key, []).append(prediction)
        return found_all

    def unsettled(
        self, folds: Folds, predictions: Mapping[tuple[str, ...], list[Prediction]]
    ) -> tuple[str, ...]:
        """A note on every model whose fit for a held-out run ran out of steps."""
        notes = []
        for key, found in predictions.items():
            pairs = zip(folds, found, strict=True)
            runs = [run for (_, some), one in pairs if not one.converged for run in some]
            sources = ", ".join(self.model.runs[run].source for run in runs)
            if runs:
                those = ", ".join(key) or "no effect"
                notes.append(f"{sources}: predicted by a fit with {those} that did not end")
        return tuple(notes)

    def _fold(
        self,
        point: FitResult,
        fitted: tuple[int, ...],
        predicted: tuple[int, ...],
        *,
        refitted: bool,
    ) -> Fold:
        """A fold that begins where the fit to all runs has ended."""
        states = tuple(point.states[self.plan.fitted.index(run)] for run in fitted)
        return Fold(
            fitted=fitted,
            predicted=predicted,
            start=replace(point, states=states),
            refitted=refitted,
            as_fitted=self.plan.as_fitted,
        )


def _best(explained: Explanation, followed: Sequence[str]) -> list[Hypothesis]:
    """Those accepted, and those that count and come somewhere near the best."""
    fitted = [c for c in explained.hypotheses if c.fit is not None]
    ranked = sorted(fitted, key=explained.evidence, reverse=True)
    least = max([EVIDENCE_THRESHOLD, *(NEAR * explained.evidence(c) for c in ranked[:1])])
    near = [c for c in ranked[:TRIED] if explained.evidence(c) > least]
    return [c for c in ranked if c in near or c.effect in followed]
