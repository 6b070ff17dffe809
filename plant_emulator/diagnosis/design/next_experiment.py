"""The next experiment: the run that would decide what these logs leave open, in one sentence.

An effect with others that cannot be told from it: the run that tells them apart. A cause that is
unknown: the run that shows most of the place where it lies, and what these logs lack there. No gap,
or other parameters only: the run that would show most of the effects that these logs could not.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.design.experiment_value import (
    Asked,
    Exchange,
    PlannedRecipe,
    apart,
    informs,
    rival,
    seen,
)
from plant_emulator.diagnosis.execution.pool import build_model
from plant_emulator.diagnosis.fitting.evidence import DETECTABLE_NORM
from plant_emulator.diagnosis.wording import listed, spoken

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from plant_emulator.diagnosis.answer import Location
    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.selection.verdict import Decision

# Rivals that are simulated, the nearest ones; each costs a fit a run.
MOST_RIVALS = 2
# A run that tells apart by so much leaves nothing to ask a dearer run for.
CLEARLY = 2.0 * DETECTABLE_NORM
# A run that shows a place less than so much better than the logs do is not worth driving for it.
BETTER = 1.2
# A run that shows this share of what the best one does, for less effort, is preferred to it.
NEARLY = 0.7
# Names in one sentence.
NAMED = 4
# What shows more of a phase of operation.
MORE_OF = {
    "standstill": "stand longer before the start",
    "breakaway": "start several times",
    "acceleration": "accelerate at several rates",
    "cruise": "hold several speeds for longer",
    "deceleration": "brake at several rates",
    "field_weakening": "hold several speeds above base speed",
}


class Advice:
    """Advice from the runs of a diagnosis; runs : the fitted ones."""

    def __init__(self, pool: Pool, recipe: Recipe, model: Model, runs: tuple[int, ...]) -> None:
        self._pool, self._recipe, self._model, self._runs = pool, recipe, model, runs

    def next_experiment(
        self,
        explained: Explanation,
        found: Decision,
        location: Location,
        hidden: Sequence[str],
    ) -> str | None:
        """The sentence, or None where nothing is left to decide.

        hidden : effects that these logs could not show
        """
        if found.kind == "effect":
            return self._separating(explained)
        if found.kind != "unknown":
            return self._showing(explained.null, hidden)
        if explained.unconverged:
            return self._steadying(explained.null)
        return self._narrowing(explained, location)

    def _separating(self, explained: Explanation) -> str | None:
        """The run that tells an effect from those that look like it."""
        pairs = [(group[0], other) for group in explained.classes() for other in group[1:]]
        pairs = pairs[:MOST_RIVALS]
        if not pairs:
            return None
        alone = {c.effect: c.fit for c in explained.hypotheses}
        exchanges = [
            Exchange(final=explained.final, name=a, other=b, alone=alone.get(b), runs=self._runs)
            for a, b in pairs
        ]
        rivals = list(self._pool.map(rival, self._recipe, exchanges))
        tried: list[tuple[str, list[float]]] = []
        for source, planned, recipe in self._planned(explained.final):
            questions = [self._asked(r, planned) for r in rivals]
            tried.append((source, list(self._pool.map(apart, recipe, questions))))
            if min(tried[-1][1]) > CLEARLY:
                break
        source, norms = max(tried, key=lambda one: told(one[1]), default=("", []))
        if max(norms, default=0.0) < DETECTABLE_NORM:
            needs = self._needs(name for pair in pairs for name in pair)
            return undecided(pairs, needs, tried=bool(tried))
        return separated(source, pairs, norms)

    def _showing(self, null: FitResult, hidden: Sequence[str]) -> str | None:
        """The run that shows most of the effects that these logs could not."""
        if not hidden:
            return None
        shown = {
            source: [name for name, norm in found.items() if norm >= DETECTABLE_NORM]
            for source, found in self._seen(null, hidden)
        }
        source = max(shown, key=lambda source: len(shown[source]), default="")
        if source and shown[source]:
            return f"Drive {source}: it would show {shown_of(shown[source], len(hidden))}."
        needs = self._needs(hidden)
        what = listed(needs, NAMED, "; ")
        return f"To see what these logs could not show: {what}." if needs else None

    def _narrowing(self, explained: Explanation, location: Location) -> str | None:
        """The run that shows most of the place where the cause lies, and what the logs lack."""
        place, model = location.subsystem, self._model
        if place is None:
            return None
        own = [c for c in explained.hypotheses if model.candidates[c.effect].subsystem == place]
        shown = self._seen(explained.null, [c.effect for c in own])
        strength = {source: norm(found.values()) for source, found in shown}
        wanted = max(
            NEARLY * max(strength.values(), default=0.0),
            BETTER * norm(c.orthogonal_norm for c in own),
        )
        best = next((source for source, by in strength.items() if by > wanted), "")
        lacking = model.missing_experiments(self._runs).get(place, ())
        parts = (
            f"drive {best}" if best else "",
            MORE_OF.get(location.phase or "", ""),
            f"add what these logs lack: {', '.join(lacking)}" if lacking else "",
        )
        advised = "; ".join(part for part in parts if part)
        return f"To narrow it down in the {spoken(place)}: {advised}." if advised else None

    def _steadying(self, null: FitResult) -> str:
        """The run that determines best what drifts."""
        sharpness: dict[str, float] = {}
        for source, planned, recipe in self._planned(null):
            (sharp,) = self._pool.map(informs, recipe, [self._asked(null, planned)])
            sharpness[source] = sharp
        best = max(sharpness, key=sharpness.__getitem__, default="")
        what = f"drive {best}" if best else "add another run, with other speeds and rates"
        return f"To steady the fit: {what}."

    def _planned(self, where: FitResult) -> list[tuple[str, int, Recipe]]:
        """Runs that were not driven: what to do, number, and the machine that has them."""
        recipe = PlannedRecipe(self._recipe, where, self._runs)
        runs = build_model(recipe).runs
        return [(runs[k].source, k, recipe) for k in range(len(self._model.runs), len(runs))]

    def _asked(self, where: FitResult, planned: int, names: Sequence[str] = ()) -> Asked:
        return Asked(where=where, runs=self._runs, planned=planned, names=tuple(names))

    def _seen(self, null: FitResult, names: Sequence[str]) -> list[tuple[str, dict[str, float]]]:
        """Every planned run with the norms of these effects' signatures."""
        planned = self._planned(null)
        if not planned or not names:
            return []
        asked = [self._asked(null, k, names) for _, k, _ in planned]
        found = self._pool.map(seen, planned[0][2], asked)
        return [(source, norms) for (source, _, _), norms in zip(planned, found, strict=True)]

    def _needs(self, names: Iterable[str]) -> list[str]:
        """What these effects need of a log, each once."""
        needs = (self._model.candidates[name].needs for name in names)
        return [need for need in dict.fromkeys(needs) if need]


def norm(values: Iterable[float]) -> float:
    """Root of the sum of squares."""
    return sqrt(sum(value * value for value in values))


def told(norms: Sequence[float]) -> tuple[int, float]:
    """How well a run tells pairs apart: how many of them, and those by how much at least."""
    apart_ = [value for value in norms if value >= DETECTABLE_NORM]
    return len(apart_), min(apart_, default=max(norms, default=0.0))


def shown_of(names: Sequence[str], hidden: int) -> str:
    """What a run shows of so many effects that the logs could not."""
    if hidden == 1:
        return f"{names[0]}, which these logs could not"
    return f"{len(names)} of the {hidden} effects that these logs could not: {listed(names, NAMED)}"


def separated(source: str, pairs: Sequence[tuple[str, str]], norms: Sequence[float]) -> str:
    """Advice to drive a run, with what it tells apart and what it does not."""
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


def undecided(pairs: Sequence[tuple[str, str]], needs: Sequence[str], *, tried: bool) -> str | None:
    """What would tell effects apart that no planned run does; None where nothing is known."""
    which = ", ".join(f"{name} from {other}" for name, other in pairs)
    what = listed(needs, NAMED, "; ")
    if tried:
        return f"No drive program tells {which}{f'; what would: {what}' if what else ''}."
    return f"What would tell {which}: {what}." if what else None
