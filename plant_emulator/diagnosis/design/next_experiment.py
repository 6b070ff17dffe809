"""The next experiment: the run that would decide what the logs leave open, in one sentence.

- Effects that the logs cannot tell apart: the run with the best discriminability.
- An unknown cause: the run that shows most effects of its subsystem, and what the logs lack there.
- A fit that did not converge: the run with the largest information gain.
- No gap, or other parameters only: the run that shows most of the effects that the logs could not.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.design.experiment_value import (
    Alternative,
    PlannedRecipe,
    PlannedRun,
    discriminability,
    fit_alternative,
    information_gain,
    visibility,
)
from plant_emulator.diagnosis.execution.pool import build_model
from plant_emulator.diagnosis.fitting.evidence import DETECTABLE_NORM
from plant_emulator.diagnosis.wording import in_words, join_items

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from plant_emulator.diagnosis.answer import Location
    from plant_emulator.diagnosis.decision.verdict import Decision
    from plant_emulator.diagnosis.execution.pool import Recipe, TaskRunner
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation

# Alternatives that are simulated, the nearest ones first; each costs a fit a run.
MOST_ALTERNATIVES = 2
# A run with this discriminability decides, so that no run of more effort is needed.
CLEAR_NORM = 2.0 * DETECTABLE_NORM
# A run is worth driving where it shows a subsystem so many times better than the logs do.
WORTHWHILE_RATIO = 1.2
# A run of less effort is preferred where it shows this share of what the best run shows.
SUFFICIENT_SHARE = 0.7
# Names in one sentence.
MOST_NAMED = 4
# What shows more of a phase of operation.
MORE_OF = {
    "standstill": "stand longer before the start",
    "breakaway": "start several times",
    "acceleration": "accelerate at several rates",
    "cruise": "hold several speeds for longer",
    "deceleration": "brake at several rates",
    "field_weakening": "hold several speeds above base speed",
}


@dataclass(frozen=True, kw_only=True)
class Advice:
    """Advice on the next experiment of a diagnosis."""

    runner: TaskRunner

    def next_experiment(
        self,
        explained: Explanation,
        decision: Decision,
        location: Location,
        hidden: Sequence[str],
    ) -> str | None:
        """Advise the next experiment in a sentence; None where nothing is left to decide.

        location : of the answer
        hidden : effects that the logs could not show
        """
        if decision.kind == "effect":
            return self._separate(explained)
        if decision.kind != "unknown":
            return self._show(explained.null, hidden)
        if explained.unconverged:
            return self._steady(explained.null)
        return self._narrow(explained, location)

    def _separate(self, explained: Explanation) -> str | None:
        """Advise the run that tells the accepted effects from those that look like them."""
        pairs = [(group[0], other) for group in explained.classes() for other in group[1:]]
        pairs = pairs[:MOST_ALTERNATIVES]
        if not pairs:
            return None
        source, norms = self._best_separation(explained, pairs)
        if max(norms, default=0.0) < DETECTABLE_NORM:
            needs = self._needs(name for pair in pairs for name in pair)
            return advise_needs(pairs, needs, tried=bool(norms))
        return advise_run(source, pairs, norms)

    def _best_separation(
        self, explained: Explanation, pairs: Sequence[tuple[str, str]]
    ) -> tuple[str, list[float]]:
        """The planned run that tells these pairs apart best, and its discriminabilities."""
        alone = {one.effect: one.fit for one in explained.hypotheses}
        runs = self.runner.runs
        alternatives = [
            Alternative(final=explained.final, name=a, other=b, alone=alone.get(b), runs=runs)
            for a, b in pairs
        ]
        fits = list(self.runner.map(fit_alternative, alternatives))
        tried: list[tuple[str, list[float]]] = []
        for source, planned, recipe in self._planned_runs(explained.final):
            asked = [PlannedRun(fitted=found, runs=runs, planned=planned) for found in fits]
            norms = list(self.runner.pool.map(discriminability, recipe, asked))
            tried.append((source, norms))
            if min(norms) > CLEAR_NORM:
                break
        return max(tried, key=lambda one: separation(one[1]), default=("", []))

    def _show(self, null: FitResult, hidden: Sequence[str]) -> str | None:
        """Advise the run that shows most of the effects that the logs could not."""
        if not hidden:
            return None
        shown = {
            source: [name for name, norm in norms.items() if norm >= DETECTABLE_NORM]
            for source, norms in self._visibilities(null, hidden)
        }
        source = max(shown, key=lambda source: len(shown[source]), default="")
        if source and shown[source]:
            return f"Drive {source}: it would show {name_shown(shown[source], len(hidden))}."
        needs = self._needs(hidden)
        what = join_items(needs, MOST_NAMED, "; ")
        return f"To see what these logs could not show: {what}." if needs else None

    def _narrow(self, explained: Explanation, location: Location) -> str | None:
        """Advise the run that shows most of the faulty subsystem, and what the logs lack there."""
        subsystem, model = location.subsystem, self.runner.model
        if subsystem is None:
            return None
        own = [
            one
            for one in explained.hypotheses
            if model.candidates[one.effect].subsystem == subsystem
        ]
        shown = self._visibilities(explained.null, [one.effect for one in own])
        strength = {source: norm(found.values()) for source, found in shown}
        wanted = max(
            SUFFICIENT_SHARE * max(strength.values(), default=0.0),
            WORTHWHILE_RATIO * norm(one.orthogonal_norm for one in own),
        )
        best = next((source for source, by in strength.items() if by > wanted), "")
        lacking = model.missing_experiments(self.runner.runs).get(subsystem, ())
        parts = (
            f"drive {best}" if best else "",
            MORE_OF.get(location.phase or "", ""),
            f"add what these logs lack: {', '.join(lacking)}" if lacking else "",
        )
        advised = "; ".join(part for part in parts if part)
        return f"To narrow it down in the {in_words(subsystem)}: {advised}." if advised else None

    def _steady(self, null: FitResult) -> str:
        """Advise the run that determines the nuisance parameters best."""
        gains: dict[str, float] = {}
        for source, planned, recipe in self._planned_runs(null):
            asked = PlannedRun(fitted=null, runs=self.runner.runs, planned=planned)
            (gains[source],) = self.runner.pool.map(information_gain, recipe, [asked])
        best = max(gains, key=gains.__getitem__, default="")
        what = f"drive {best}" if best else "add another run, with other speeds and rates"
        return f"To steady the fit: {what}."

    def _planned_runs(self, found: FitResult) -> list[tuple[str, int, Recipe]]:
        """Planned runs at a fit: what to do, the run's number, and the recipe that has it."""
        recipe = PlannedRecipe(self.runner.recipe, found, self.runner.runs)
        runs = build_model(recipe).runs
        own = len(self.runner.model.runs)
        return [(runs[k].source, k, recipe) for k in range(own, len(runs))]

    def _visibilities(
        self, null: FitResult, names: Sequence[str]
    ) -> list[tuple[str, dict[str, float]]]:
        """Visibility of these effects in each planned run, by what to do."""
        planned = self._planned_runs(null)
        if not planned or not names:
            return []
        asked = [
            PlannedRun(fitted=null, runs=self.runner.runs, planned=k, effects=tuple(names))
            for _, k, _ in planned
        ]
        found = self.runner.pool.map(visibility, planned[0][2], asked)
        return [(source, norms) for (source, _, _), norms in zip(planned, found, strict=True)]

    def _needs(self, names: Iterable[str]) -> list[str]:
        """Sensors and manoeuvres that these effects need of a log, each once."""
        needs = (self.runner.model.candidates[name].needs for name in names)
        return [need for need in dict.fromkeys(needs) if need]


def norm(values: Iterable[float]) -> float:
    """Root of the sum of squares."""
    return sqrt(sum(value * value for value in values))


def separation(norms: Sequence[float]) -> tuple[int, float]:
    """Number of pairs that a run separates, and the least of their norms; larger is better."""
    clear = [value for value in norms if value >= DETECTABLE_NORM]
    return len(clear), min(clear, default=max(norms, default=0.0))


def name_shown(names: Sequence[str], hidden: int) -> str:
    """Name the effects that a run shows, of so many that the logs could not."""
    if hidden == 1:
        return f"{names[0]}, which these logs could not"
    shown = join_items(names, MOST_NAMED)
    return f"{len(names)} of the {hidden} effects that these logs could not: {shown}"


def advise_run(source: str, pairs: Sequence[tuple[str, str]], norms: Sequence[float]) -> str:
    """Advise to drive a run; say which pairs it tells apart and which it does not."""
    clear: dict[str, list[str]] = {}
    rest = []
    for (name, other), by in zip(pairs, norms, strict=True):
        if by < DETECTABLE_NORM:
            rest.append(f"{name} from {other}")
        else:
            clear.setdefault(name, []).append(f"from {other} by {by:.0f}")
    named = [f"{name} differs {' and '.join(others)}" for name, others in clear.items()]
    more = f"; it does not tell {', '.join(rest)}" if rest else ""
    return f"Drive {source}: there {'; '.join(named)} times the noise{more}."


def advise_needs(
    pairs: Sequence[tuple[str, str]], needs: Sequence[str], *, tried: bool
) -> str | None:
    """Say what would tell effects apart that no planned run does; None where nothing is known."""
    which = ", ".join(f"{name} from {other}" for name, other in pairs)
    what = join_items(needs, MOST_NAMED, "; ")
    if tried:
        return f"No drive program tells {which}{f'; what would: {what}' if what else ''}."
    return f"What would tell {which}: {what}." if what else None
