"""Whether an answer is right, and the shares of right answers over a trial."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from typing import TYPE_CHECKING, Any

from plant_emulator.blind.detectable import DETECTABLE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.blind.case import Case, Hidden
    from plant_emulator.effects import Effect

# A class of more names is no answer.
LARGEST_CLASS = 3
# Half width of a 95 % interval [standard errors].
INTERVAL = 1.96

Answer = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Unsealed:
    """A case beside its answer.

    norms : of every hidden effect; answer : None where the diagnosis failed
    closed : the true closed fraction
    """

    case: Case
    norms: Mapping[str, float]
    answer: Answer | None
    closed: float | None

    @property
    def wanted(self) -> set[str]:
        """Hidden effects of the library that can be detected."""
        return {
            h.effect
            for h in self.case.hidden
            if self.norms[h.effect] > DETECTABLE and not h.outside
        }

    @property
    def detectable(self) -> bool:
        """Whether anything hidden can be detected."""
        return any(norm > DETECTABLE for norm in self.norms.values())

    @property
    def kind(self) -> str:
        """The verdict."""
        return "failed" if self.answer is None else str(self.answer["verdict"]["kind"])

    @property
    def named(self) -> list[str]:
        """Effects in the answer."""
        return [] if self.answer is None else list(self.answer["verdict"]["effects"])

    @property
    def column(self) -> str:
        """The answer's column in the confusion matrix."""
        return "+".join(sorted(self.named)) if self.kind == "effect" else self.kind


def classes(unsealed: Unsealed) -> list[set[str]]:
    """For every effect that is named the class it stands for."""
    assert unsealed.answer is not None
    found = [set(names) for names in unsealed.answer["verdict"]["class"]]
    pairs = zip(unsealed.named, found, strict=True)
    return [names if len(names) <= LARGEST_CLASS else {name} for name, names in pairs]


def hit(unsealed: Unsealed) -> bool:
    """Whether the classes named stand for hidden effects, all detectable ones among them."""
    if unsealed.kind != "effect":
        return False
    stand = classes(unsealed)
    hidden = [h.effect for h in unsealed.case.hidden]
    return any(
        unsealed.wanted <= set(order)
        and all(name in names for name, names in zip(order, stand, strict=True))
        for order in permutations(hidden, len(stand))
    )


def right(unsealed: Unsealed) -> bool:
    """Whether the verdict is right; what cannot be detected need not be, but no other be named."""
    kind = unsealed.kind
    match unsealed.case.kind:
        case "none":
            return kind == "none"
        case "drift":
            return kind == "parameter"
        case "outside":
            return kind == "unknown" or (not unsealed.detectable and kind in {"none", "parameter"})
        case _:
            return hit(unsealed) or (not unsealed.wanted and kind in {"none", "parameter"})


def false_alarm(unsealed: Unsealed) -> bool:
    """Whether a cause is claimed, or a gap without a cause, where only parameters drifted."""
    return unsealed.case.kind in {"none", "drift"} and unsealed.kind in {"effect", "unknown"}


def located(unsealed: Unsealed) -> bool:
    """Whether the place is that of a hidden effect."""
    if unsealed.answer is None:
        return False
    place = unsealed.answer["location"]["subsystem"]
    return place in {h.subsystem for h in unsealed.case.hidden}


def evidence(unsealed: Unsealed) -> float | None:
    """Evidence of the weakest effect that is named, or of the best one where none is."""
    if unsealed.answer is None:
        return None
    found = {one["effect"]: float(one["evidence"]) for one in unsealed.answer["ranking"]}
    named = [found[name] for name in unsealed.named if name in found]
    return min(named) if named else max(found.values(), default=0.0)


def sizes(unsealed: Unsealed, known: Mapping[str, Effect]) -> list[dict[str, Any]]:
    """True and estimated sizes of effects that are rightly named, where law and library share them.

    A size is shared that both declare by the same name.
    """
    if unsealed.answer is None:
        return []
    ranking = {one["effect"]: one["parameters"] for one in unsealed.answer["ranking"]}
    return [
        _size(hidden, estimated)
        for hidden in unsealed.case.hidden
        if hidden.effect in unsealed.named
        for estimated in ranking.get(hidden.effect, [])
        if _shared(estimated["name"], hidden, known)
    ]


def _shared(name: str, hidden: Hidden, known: Mapping[str, Effect]) -> bool:
    declared = known[hidden.law].parameters.get(name)
    return declared is not None and declared.neutral != declared.plausible


def _size(hidden: Hidden, estimated: Mapping[str, Any]) -> dict[str, Any]:
    """One size; the amplitude of a ripple has no sign of its own, but its phase."""
    true, value = hidden.values[estimated["name"]], estimated["value"]
    if any("phase" in state for state in hidden.states):
        true, value = abs(true), abs(value)
    error = estimated["standard_error"]
    return {
        "effect": hidden.effect,
        "parameter": estimated["name"],
        "true": true,
        "estimated": value,
        "standard_error": error,
        "covered": abs(value - true) <= INTERVAL * error,
        "same_law": hidden.law == hidden.effect,
    }


def detail(unsealed: Unsealed, known: Mapping[str, Effect]) -> dict[str, Any]:
    """One case as the answer and the spreadsheet tell it."""
    case, answer = unsealed.case, unsealed.answer
    verdict = {} if answer is None else answer["verdict"]
    gap = {} if answer is None else answer["gap"]
    return {
        "case": case.number + 1,
        "kind": case.kind,
        "truth": case.truth,
        "hidden": [
            {
                "effect": h.effect,
                "law": h.law,
                "subsystem": h.subsystem,
                "values": dict(h.values),
                "norm": unsealed.norms[h.effect],
            }
            for h in case.hidden
        ],
        "programs": list(case.programs),
        "detectable": unsealed.detectable,
        "verdict": unsealed.kind,
        "effects": unsealed.named,
        "class": verdict.get("class", []),
        "answered": unsealed.column,
        "evidence": evidence(unsealed),
        "confidence": verdict.get("confidence"),
        "right": right(unsealed),
        "top1": sorted(unsealed.named) == sorted(h.effect for h in case.hidden),
        "false_alarm": false_alarm(unsealed),
        "subsystem": None if answer is None else answer["location"]["subsystem"],
        "located": located(unsealed),
        "closed_fraction": gap.get("closed_fraction"),
        "closed_fraction_ci95": gap.get("closed_fraction_ci95"),
        "closed_fraction_true": unsealed.closed,
        "sizes": sizes(unsealed, known),
    }


def confusion(details: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, int]]:
    """How often each truth got each answer."""
    counts: dict[str, dict[str, int]] = {}
    for one in details:
        row = counts.setdefault(one["truth"], {})
        row[one["answered"]] = row.get(one["answered"], 0) + 1
    return {truth: dict(sorted(row.items())) for truth, row in sorted(counts.items())}
