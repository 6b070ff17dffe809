"""The verdict of an answer: what was decided, and the sentence that says it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import ParameterDeviation, Verdict
from plant_emulator.diagnosis.wording import in_words, percent, quantity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.calibration.confidence import Standing
    from plant_emulator.diagnosis.decision.verdict import Decision
    from plant_emulator.diagnosis.machine import Candidate


def verdict(
    decision: Decision,
    *,
    classes: Sequence[Sequence[str]],
    confidence: float | None,
    standing: Standing,
    sentence: str,
    next_experiment: str | None,
) -> Verdict:
    """The verdict of the answer; classes : see `Verdict`, of the accepted effects."""
    return Verdict(
        kind=decision.kind,
        effects=decision.effects,
        classes=tuple(map(tuple, classes)) if decision.kind == "effect" else (),
        parameters=tuple(
            ParameterDeviation(
                name=shift.name,
                nominal=shift.nominal,
                estimated=shift.estimated,
                standard_error=shift.standard_error,
                unit=shift.unit,
            )
            for shift in decision.deviations
        ),
        confidence=confidence,
        statement=sentence,
        next_experiment=next_experiment,
        log_odds=standing.log_odds,
    )


def statement(
    decision: Decision,
    candidates: Mapping[str, Candidate],
    closed: float | None,
    subsystem: str | None,
) -> str:
    """The verdict in one sentence.

    closed : closed fraction of the held-out gap; subsystem : where the gap lies
    """
    match decision.kind:
        case "effect":
            return _effects(decision, candidates, closed)
        case "parameter":
            return _other_values(decision)
        case "none":
            return "The logs show no gap beyond the noise of the sensors."
    where = "" if subsystem is None else f" It lies in the {in_words(subsystem)}."
    return f"There is a gap whose cause is unknown: {decision.reason}.{where}"


def _effects(decision: Decision, candidates: Mapping[str, Candidate], closed: float | None) -> str:
    named = [_describe_effect(name, candidates[name]) for name in decision.effects]
    them = "it" if len(decision.effects) == 1 else "them"
    more = "" if closed is None else f"; with {them} the held-out gap closes by {percent(closed)}"
    return f"The machine has what the model lacks: {' and '.join(named)}{more}."


def _describe_effect(name: str, candidate: Candidate) -> str:
    """An effect, and what it is."""
    title = f"{candidate.title[:1].lower()}{candidate.title[1:]}"
    chance = ", random, so that no simulation can follow it" if candidate.stochastic else ""
    return f"{name} ({title}{chance})"


def _other_values(decision: Decision) -> str:
    first = decision.deviations[0]
    if first.nominal:
        change = f"{100.0 * (first.estimated / first.nominal - 1.0):+.1f} %"
    else:
        change = quantity(first.estimated, first.unit, 4)
    others = len(decision.deviations) - 1
    more = f" and {others} other parameter{'s' if others > 1 else ''}" if others else ""
    return (
        f"The equations hold with other values: {first.name} is {change}{more}; "
        "no unmodelled effect is needed."
    )
