"""Judges whether a diagnosis of a case is right."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from typing import TYPE_CHECKING

from plant_emulator.blind.orthogonal_norm import DETECTABLE
from plant_emulator.blind.result import CaseResult, HiddenEffect, ScoredSize

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.blind.case import Case, Hidden
    from plant_emulator.diagnosis.answer import Answer, Quantity
    from plant_emulator.effects import Effect

# A larger class counts as a single name.
LARGEST_CLASS = 3
# Half width of a 95 % interval [standard errors].
INTERVAL = 1.96


@dataclass(frozen=True, kw_only=True)
class Unsealed:
    """An unsealed case and its diagnosis.

    norms : orthogonal norm of every hidden effect by name
    answer : of the diagnosis; None if it failed
    closed : true closed fraction of the gap
    """

    case: Case
    norms: Mapping[str, float]
    answer: Answer | None
    closed: float | None

    @property
    def wanted(self) -> set[str]:
        """Hidden effects of the library that are detectable."""
        return {
            h.effect
            for h in self.case.hidden
            if self.norms[h.effect] > DETECTABLE and not h.outside
        }

    @property
    def detectable(self) -> bool:
        """Whether any hidden effect is detectable."""
        return any(norm > DETECTABLE for norm in self.norms.values())

    @property
    def kind(self) -> str:
        """Kind of the verdict, or "failed"."""
        return "failed" if self.answer is None else self.answer.verdict.kind

    @property
    def named(self) -> tuple[str, ...]:
        """Effects that the verdict names."""
        return () if self.answer is None else self.answer.verdict.effects

    @property
    def column(self) -> str:
        """The answer's column in the confusion matrix."""
        return "+".join(sorted(self.named)) if self.kind == "effect" else self.kind


def classes(unsealed: Unsealed) -> list[set[str]]:
    """Class of every named effect: the effects that its name stands for."""
    assert unsealed.answer is not None
    pairs = zip(unsealed.named, unsealed.answer.verdict.classes, strict=True)
    return [set(names) if len(names) <= LARGEST_CLASS else {name} for name, names in pairs]


def is_hit(unsealed: Unsealed) -> bool:
    """Whether each class holds a hidden effect of its own, and no detectable one is missed."""
    if unsealed.kind != "effect":
        return False
    found = classes(unsealed)
    hidden = [h.effect for h in unsealed.case.hidden]
    return any(
        unsealed.wanted <= set(order)
        and all(name in names for name, names in zip(order, found, strict=True))
        for order in permutations(hidden, len(found))
    )


def is_right(unsealed: Unsealed) -> bool:
    """Whether the verdict is right.

    A hidden effect that is not detectable may be missed, but no other effect may be named.
    """
    kind = unsealed.kind
    match unsealed.case.kind:
        case "none":
            return kind == "none"
        case "deviation":
            return kind == "parameter"
        case "outside":
            return kind == "unknown" or (not unsealed.detectable and kind in {"none", "parameter"})
        case _:
            return is_hit(unsealed) or (not unsealed.wanted and kind in {"none", "parameter"})


def is_false_alarm(unsealed: Unsealed) -> bool:
    """Whether the verdict is an effect or unknown, although the case hides no effect."""
    return unsealed.case.kind in {"none", "deviation"} and unsealed.kind in {"effect", "unknown"}


def is_located(unsealed: Unsealed) -> bool:
    """Whether the fault location is the subsystem of a hidden effect."""
    if unsealed.answer is None:
        return False
    return unsealed.answer.location.subsystem in {h.subsystem for h in unsealed.case.hidden}


def weakest_evidence(unsealed: Unsealed) -> float | None:
    """Smallest evidence of the named effects; without a name, the largest of the ranking."""
    if unsealed.answer is None:
        return None
    found = {one.effect: one.evidence for one in unsealed.answer.ranking}
    named = [found[name] for name in unsealed.named if name in found]
    return min(named) if named else max(found.values(), default=0.0)


def sizes(
    hidden: Sequence[Hidden],
    named: Sequence[str],
    estimates: Mapping[str, Sequence[Quantity]],
    effects: Mapping[str, Effect],
) -> tuple[ScoredSize, ...]:
    """True and estimated sizes of the hidden effects that are named.

    A size is compared if hidden law and library declare it by the same name.
    estimates : of every effect by name; effects : library and laws of the trial by name
    """
    return tuple(
        _size(one, estimated)
        for one in hidden
        if one.effect in named
        for estimated in estimates.get(one.effect, ())
        if _is_shared(estimated.name, one, effects)
    )


def _is_shared(name: str, hidden: Hidden, effects: Mapping[str, Effect]) -> bool:
    declared = effects[hidden.law].parameters.get(name)
    return declared is not None and declared.neutral != declared.plausible


def _size(hidden: Hidden, estimated: Quantity) -> ScoredSize:
    """True and estimated size; of an amplitude with a phase the magnitudes are compared."""
    true, value = hidden.values[estimated.name], estimated.value
    if any("phase" in state for state in hidden.states):
        true, value = abs(true), abs(value)
    return ScoredSize(
        effect=hidden.effect,
        parameter=estimated.name,
        true=true,
        estimated=value,
        standard_error=estimated.standard_error,
        covered=abs(value - true) <= INTERVAL * estimated.standard_error,
        same_law=hidden.law == hidden.effect,
    )


def score(
    unsealed: Unsealed, effects: Mapping[str, Effect], *, seconds: float = 0.0, error: str = ""
) -> CaseResult:
    """Score one case.

    effects : library and laws of the trial by name
    seconds : duration of the case; error : last line of a failed diagnosis
    """
    case, answer = unsealed.case, unsealed.answer
    estimates = {one.effect: one.parameters for one in answer.ranking} if answer else {}
    return CaseResult(
        case=case.number + 1,
        kind=case.kind,
        truth=case.truth,
        hidden=tuple(_hidden_effect(h, unsealed.norms[h.effect]) for h in case.hidden),
        programs=case.programs,
        dirt="" if case.dirt is None else case.dirt.kind,
        detectable=unsealed.detectable,
        verdict=unsealed.kind,
        effects=unsealed.named,
        classes=answer.verdict.classes if answer else (),
        answered=unsealed.column,
        evidence=weakest_evidence(unsealed),
        confidence=answer.verdict.confidence if answer else None,
        log_odds=answer.verdict.log_odds if answer else None,
        right=is_right(unsealed),
        top1=sorted(unsealed.named) == sorted(h.effect for h in case.hidden),
        false_alarm=is_false_alarm(unsealed),
        subsystem=answer.location.subsystem if answer else None,
        located=is_located(unsealed),
        closed_fraction=answer.gap.closed_fraction if answer else None,
        closed_fraction_ci95=answer.gap.closed_fraction_ci95 if answer else None,
        closed_fraction_true=unsealed.closed,
        sizes=sizes(case.hidden, unsealed.named, estimates, effects),
        seconds=seconds,
        error=error,
    )


def _hidden_effect(hidden: Hidden, norm: float) -> HiddenEffect:
    return HiddenEffect(
        effect=hidden.effect,
        law=hidden.law,
        subsystem=hidden.subsystem,
        values=dict(hidden.values),
        norm=norm,
    )
