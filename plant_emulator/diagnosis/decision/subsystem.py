"""The subsystem of the answer: where the verdict's cause lies, or else where the gap lies."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import Location

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.decision.verdict import Decision
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Candidate, Model


def evidence_shares(
    explained: Explanation, candidates: Mapping[str, Candidate]
) -> dict[str, float]:
    """Share of each subsystem in the falls of the cost that its best effect brings [1]."""
    best: dict[str, float] = {}
    for hypothesis in explained.hypotheses:
        if hypothesis.fit is not None:
            subsystem = candidates[hypothesis.effect].subsystem
            fall = max(0.0, explained.null.cost - hypothesis.fit.cost)
            best[subsystem] = max(best.get(subsystem, 0.0), fall)
    total = sum(best.values())
    return {name: fall / total for name, fall in best.items()} if total > 0.0 else {}


def faulty_subsystem(
    decision: Decision,
    candidates: Mapping[str, Candidate],
    shares: Mapping[str, float],
) -> str | None:
    """Subsystem of the decision's cause, or of the largest share; None where there is no gap.

    shares : of the gap, by subsystem
    Of several effects the one in the subsystem of the largest share counts. Of several parameters
    the first one counts.
    """
    if decision.kind == "none":
        return None
    if decision.kind == "parameter":
        return decision.deviations[0].subsystem
    if decision.kind == "effect":
        subsystems = [candidates[name].subsystem for name in decision.effects]
        return max(subsystems, key=lambda name: shares.get(name, 0.0))
    return max(shares, key=shares.__getitem__, default=None)


def locate_gap(model: Model, task: Task) -> Location | None:
    """Find the block that holds the gap of the fit `task.base` (a step)."""
    return model.locate(task.base, task.runs)


def location(
    subsystem: str | None, shares: Mapping[str, float], located: Location | None
) -> Location:
    """Location of the answer.

    subsystem : of the decision; None: there is no gap
    shares : of the gap, by subsystem
    located : what the machine's blocks say; None: it has none, and the shares are those of the
        evidence
    """
    if located is None:
        ordered = dict(sorted(shares.items(), key=lambda pair: -pair[1]))
        return Location(subsystem=subsystem, channel=None, phase=None, shares=ordered, cells=())
    if subsystem is None:
        return replace(located, subsystem=None, channel=None, phase=None)
    return replace(located, subsystem=subsystem)
