"""The verdict: an effect, other parameters, nothing, or unknown, and the sentence that says it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from plant_emulator.diagnosis.fitting.evidence import STRUCTURED, adequate, evident
from plant_emulator.diagnosis.prediction.remainder import lies, shrinks
from plant_emulator.diagnosis.wording import number, percent

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.diagnosis.prediction.remainder import Rest

Kind = Literal["effect", "parameter", "none", "unknown"]

# A parameter has shifted from so many of its own standard errors on.
SHIFTED = 3.0
# The same of a shift that is none by chance, of some ten parameters in a hundred diagnoses.
SURE = 4.0
# Mean square of the whitened residual up to which a model without effects leaves nothing but noise.
NOISE_ONLY = 1.1


@dataclass(frozen=True, kw_only=True)
class Shift:
    """A parameter that left its nominal value; surprise : in prior standard deviations."""

    name: str
    nominal: float
    estimated: float
    standard_error: float
    unit: str
    subsystem: str
    surprise: float

    @property
    def sure(self) -> bool:
        """Whether chance does not explain it."""
        return abs(self.estimated - self.nominal) > SURE * self.standard_error


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """See the contract of the answer; reason : why it is unknown, empty else."""

    kind: Kind
    effects: tuple[str, ...]
    shifts: tuple[Shift, ...]
    reason: str


def shifts(model: Model, found: FitResult) -> tuple[Shift, ...]:
    """Parameters more than SHIFTED standard errors from nominal: those that chance does not explain
    first, of these the most surprising.
    """
    moved = []
    for unknown in model.parameters:
        value, error = found.values[unknown.name], found.errors[unknown.name]
        if abs(value - unknown.prior) <= SHIFTED * error:
            continue
        std = unknown.std if unknown.std is not None else abs(unknown.prior)
        moved.append(
            Shift(
                name=unknown.name,
                nominal=unknown.prior,
                estimated=value,
                standard_error=error,
                unit=model.units[unknown.name],
                subsystem=model.subsystems[unknown.name],
                surprise=abs(value - unknown.prior) / std,
            )
        )
    return tuple(sorted(moved, key=lambda shift: (not shift.sure, -shift.surprise)))


def decide(model: Model, explained: Explanation) -> Verdict:
    """The verdict of a contest."""
    found = _of_contest(model, explained)
    if explained.chance and found.kind != "unknown":
        return replace(found, kind="effect", effects=explained.named)
    return found


def _of_contest(model: Model, explained: Explanation) -> Verdict:
    null, final = explained.null, explained.final
    moved = shifts(model, final)
    if explained.unconverged:
        return Verdict(kind="unknown", effects=(), shifts=moved, reason=explained.unconverged)
    if model.reaches_noise and _structured(explained):
        reason = "what is left is as small as the noise, but not as random"
        return Verdict(kind="unknown", effects=(), shifts=moved, reason=reason)
    if final.unsure and not (len(final.effects) == 1 and evident(final, null)):
        name = final.unsure[0]
        reason = f"it differs between the runs; {name} would do, but no size of it is certain"
        return Verdict(kind="unknown", effects=(), shifts=moved, reason=reason)
    if final.effects and (adequate(final, null) or not model.reaches_noise):
        return Verdict(kind="effect", effects=final.effects, shifts=moved, reason="")
    moved = shifts(model, null)
    if not final.effects and null.chi_squared <= NOISE_ONLY:
        kind: Kind = "parameter" if any(shift.sure for shift in moved) else "none"
        return Verdict(kind=kind, effects=(), shifts=moved, reason="")
    return Verdict(
        kind="unknown",
        effects=(),
        shifts=moved,
        reason="no effect of the library, alone or with others, brings the residual to the noise",
    )


def _structured(explained: Explanation) -> bool:
    """Whether more structure is left than was explained, and more than noise has by chance.

    Of a model that leaves more than the noise the squares tell.
    """
    null, final = explained.null, explained.final
    small = adequate(final, null) if final.effects else null.chi_squared <= NOISE_ONLY
    gained = null.cost - final.cost + sum(one.evidence for one in explained.chance)
    return small and final.structure > max(STRUCTURED, gained)


def statement(
    verdict: Verdict,
    candidates: Mapping[str, Candidate],
    closed: float | None,
    place: str | None,
    *,
    terms: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
    rest: Rest | None = None,
) -> str:
    """The verdict in one sentence.

    terms : by effect, what the field knows it by
    rest : of a machine in outline, of which more than the noise is left
    """
    if verdict.kind == "effect":
        named = [_named(name, candidates[name], terms or {}) for name in verdict.effects]
        share = "" if closed is None else f"the held-out gap closes by {percent(closed)}"
        if rest is not None:
            share = f"{shrinks(rest)}; {lies(rest)}"
        them = "it" if len(verdict.effects) == 1 else "them"
        more = f"; with {them} {share}" if share else ""
        return f"The machine has what the model lacks: {' and '.join(named)}{more}."
    if verdict.kind == "parameter":
        first = verdict.shifts[0]
        change = 100.0 * (first.estimated / first.nominal - 1.0)
        others = len(verdict.shifts) - 1
        more = "" if others == 0 else f" and {others} other parameters"
        return (
            f"The equations hold with other values: {first.name} is {change:+.1f} %{more}; "
            "no unmodelled effect is needed."
        )
    if verdict.kind == "none":
        return "The logs show no gap beyond the noise of the sensors."
    where = "" if place is None else f" It lies in the {place.replace('_', ' ')}."
    where = where if rest is None else f" Of the held-out {rest.channel}, {lies(rest)}."
    return f"There is a gap whose cause is unknown: {verdict.reason}.{where}"


def _named(
    name: str, candidate: Candidate, terms: Mapping[str, Sequence[Mapping[str, Any]]]
) -> str:
    """An effect, what it is, and its terms."""
    title = f"{candidate.title[:1].lower()}{candidate.title[1:]}"
    values = ", ".join(
        f"{number(t['value'], 4)} {t['unit']} {t['name']}" for t in terms.get(name, ())
    )
    chance = ", by chance, so that no simulation follows it" if candidate.untold else ""
    return f"{name} ({title}{chance}{': ' if values else ''}{values})"


def as_answer(
    verdict: Verdict,
    *,
    classes: Sequence[Sequence[str]],
    confidence: float | None,
    sentence: str,
    next_experiment: str | None,
) -> dict[str, Any]:
    """The part `verdict` of the answer."""
    return {
        "kind": verdict.kind,
        "effects": list(verdict.effects),
        "class": [list(names) for names in classes] if verdict.kind == "effect" else [],
        "parameters": [
            {
                "name": s.name,
                "nominal": s.nominal,
                "estimated": s.estimated,
                "standard_error": s.standard_error,
                "unit": s.unit,
            }
            for s in verdict.shifts
        ],
        "confidence": confidence,
        "statement": sentence,
        "next_experiment": next_experiment,
    }
