"""Where the gap lies, as the answer tells it: the verdict's own place, or the gap's."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import Location

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.diagnosis.selection.verdict import Decision


def evidence_shares(
    explained: Explanation, candidates: Mapping[str, Candidate]
) -> dict[str, float]:
    """Share of each subsystem, by the best fall of the cost that one of its effects brings."""
    best: dict[str, float] = {}
    for contender in explained.hypotheses:
        if contender.fit is not None:
            place = candidates[contender.effect].subsystem
            fall = max(0.0, explained.null.cost - contender.fit.cost)
            best[place] = max(best.get(place, 0.0), fall)
    total = sum(best.values())
    return {place: fall / total for place, fall in best.items()} if total > 0.0 else {}


def subsystem(
    decision: Decision,
    candidates: Mapping[str, Candidate],
    shares: Mapping[str, float],
) -> str | None:
    """The place of the effect with the largest share there, of the most surprising parameter, or of
    the gap.
    """
    if decision.kind == "none":
        return None
    if decision.kind == "parameter":
        return decision.deviations[0].subsystem
    if decision.kind == "effect":
        places = [candidates[name].subsystem for name in decision.effects]
        return max(places, key=lambda place: shares.get(place, 0.0))
    return max(shares, key=shares.__getitem__, default=None)


def site(model: Model, task: Task) -> Location | None:
    """Step of a diagnosis: the block that the gap of a fit lies in."""
    return model.locate(task.base, task.runs)


def location(place: str | None, shares: Mapping[str, float], located: Location | None) -> Location:
    """The location of the answer.

    place : the verdict's; None: there is no gap
    located : what the machine's blocks say; None: the shares are those of the evidence
    """
    if located is None:
        ordered = dict(sorted(shares.items(), key=lambda pair: -pair[1]))
        return Location(subsystem=place, channel=None, phase=None, shares=ordered, cells=())
    if place is None:
        return replace(located, subsystem=None, channel=None, phase=None)
    return replace(located, subsystem=place)
