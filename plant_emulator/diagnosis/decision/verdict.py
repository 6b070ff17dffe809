"""What the hypothesis tests decide: an effect, other parameters, nothing, or unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.calibration.model_form_error import size_error
from plant_emulator.diagnosis.fitting.evidence import (
    LJUNG_BOX_LIMIT,
    NOISE_MEAN_SQUARE,
    UNEXPLAINED_SHARE,
    adequate,
    significant,
)
from plant_emulator.diagnosis.fitting.joint_fit import AT_BOUND
from plant_emulator.diagnosis.search.summary import search_step, unconverged
from plant_emulator.estimation.noise.channel_noise import MOST_PREDICTABLE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.answer import Kind
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Unknown

# A parameter deviates from its nominal value from so many of its standard errors on.
DEVIATION_ERRORS = 3.0
# A deviation of so many standard errors is no chance, among some ten parameters in a hundred
# diagnoses.
SIGNIFICANT_DEVIATION_ERRORS = 4.0
# A state is improbable from so many standard deviations of its prior on.
IMPROBABLE_DEVIATIONS = 3.0
# Mean square up to which a fit without effects leaves nothing but noise.
NULL_MEAN_SQUARE = 1.1


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """A parameter that deviates from its nominal value [unit].

    surprise : the deviation in prior standard deviations [1]
    """

    name: str
    nominal: float
    estimated: float
    standard_error: float
    unit: str
    subsystem: str
    surprise: float

    @property
    def significant(self) -> bool:
        """Whether chance does not explain the deviation."""
        limit = SIGNIFICANT_DEVIATION_ERRORS * self.standard_error
        return abs(self.estimated - self.nominal) > limit


@dataclass(frozen=True, kw_only=True)
class Decision:
    """The kind of the verdict, the accepted effects, and the parameters that deviate.

    reason : why the cause is unknown; empty where it is known
    """

    kind: Kind
    effects: tuple[str, ...]
    deviations: tuple[Deviation, ...]
    reason: str


def deviations(model: Model, found: FitResult) -> tuple[Deviation, ...]:
    """Parameters more than DEVIATION_ERRORS standard errors from nominal.

    The significant ones come first, among them the most surprising one.
    """
    moved = []
    for unknown in model.parameters:
        value, error = found.values[unknown.name], found.standard_errors[unknown.name]
        if abs(value - unknown.prior) <= DEVIATION_ERRORS * error:
            continue
        std = unknown.std if unknown.std is not None else abs(unknown.prior)
        moved.append(
            Deviation(
                name=unknown.name,
                nominal=unknown.prior,
                estimated=value,
                standard_error=error,
                unit=model.units[unknown.name],
                subsystem=model.subsystems[unknown.name],
                surprise=abs(value - unknown.prior) / std,
            )
        )
    return tuple(sorted(moved, key=lambda one: (not one.significant, -one.surprise)))


def decide(model: Model, explained: Explanation) -> Decision:
    """Decide what the hypothesis tests say of the cause."""
    reason = _reason_against(explained) or _improbable(model, explained.final)
    if reason:
        moved = deviations(model, explained.final)
        return Decision(kind="unknown", effects=(), deviations=moved, reason=reason)
    decision = _without_regularity(explained, _decide_by_fits(model, explained))
    if explained.random_effects and decision.kind != "unknown":
        return replace(decision, kind="effect", effects=explained.named)
    return decision


def without_uncertain(
    model: Model,
    explained: Explanation,
    decision: Decision,
    model_form_errors: Mapping[str, float],
) -> tuple[Explanation, Decision]:
    """Name no effect that noise can do without, and none of whose sizes is told from neutral.

    Such an effect repairs a local minimum, or the laws of others. The error of a size holds those
    of all laws. Beside others the effect stays in the fit, and only the one that closes least falls
    (the others may need each other). Alone, the fit without effects decides.

    model_form_errors : relative, of the sizes by name; see `calibration.model_form_error`
    """
    final, null = explained.final, explained.null
    if not decision.effects or not final.effects:
        return explained, decision
    found = _uncertain(final, model.candidates, model_form_errors)
    squares = {one: _square_without(one, explained) for one in found - explained.uncertain}
    least = min(squares, key=squares.__getitem__, default="")
    if not least or squares[least] > NOISE_MEAN_SQUARE * final.samples:
        return explained, decision
    if len(explained.named) > 1:
        uncertain = explained.uncertain | {least}
        rest = replace(final, effects=tuple(e for e in final.effects if e not in uncertain))
        step = search_step(null, f"the size of {least} is uncertain", rest)
        named = replace(explained, uncertain=uncertain, trace=(*explained.trace, step))
        return named, replace(decision, effects=named.named)
    step = search_step(null, f"the size of {least} is uncertain", null)
    without = replace(
        explained,
        trace=(*explained.trace, step),
        final=null,
        uncertain=frozenset(),
        reduced_costs={},
        alternatives={},
        unconverged=unconverged(null),
        log_odds=-abs(explained.log_odds),
    )
    return without, decide(model, without)


def _square_without(name: str, explained: Explanation) -> float:
    """Sum of squares of the fit without one of the accepted effects [chi squared]."""
    if explained.final.effects == (name,):
        return explained.null.sum_of_squares
    rise = explained.reduced_costs.get(name, inf) - explained.final.cost
    return explained.final.sum_of_squares + rise


def _uncertain(
    final: FitResult, candidates: Mapping[str, Candidate], model_form_errors: Mapping[str, float]
) -> frozenset[str]:
    """Effects of a fit none of whose sizes is told from neutral."""

    def certain(candidate: Candidate, size: Unknown) -> bool:
        neutral = candidate.neutral[size.name]
        found, plausible = final.values[size.name] - neutral, abs(size.start - neutral)
        error = size_error(
            found,
            final.standard_errors[size.name],
            plausible,
            model_form_errors.get(size.name, 0.0),
        )
        return abs(found) > error

    return frozenset(
        name
        for name in final.effects
        if not any(certain(candidates[name], size) for size in candidates[name].sizes)
    )


def _reason_against(explained: Explanation) -> str:
    """Why the final fit cannot be trusted; empty where it can."""
    null, final = explained.null, explained.final
    if explained.unconverged:
        return explained.unconverged
    for channel, noise in explained.noise.items():
        if noise.colour.predictable > MOST_PREDICTABLE:
            return f"what is left of {channel} follows its own past as no noise of a sensor does"
    if _is_structured(explained):
        return "what is left is as small as the noise, but not as random"
    if final.insignificant and not (len(final.effects) == 1 and significant(final, null)):
        name = final.insignificant[0]
        return f"it differs between the runs; {name} would do, but no size of it is certain"
    return ""


def _improbable(model: Model, final: FitResult) -> str:
    """Why effects stand for another cause; empty where they may be the cause.

    A parameter for certain at the bound of what a machine may have bends for what they lack. A
    state that scales with the size, as a temperature at the start, lies far off its prior in
    every run where its effect stands for something that is the same in all runs: a motor that is
    as hot whenever a run begins has another resistance.
    """
    certain = {one.name for one in deviations(model, final) if one.significant}
    for u in model.parameters if final.effects else ():
        moved = u.scaled(final.values[u.name]) - u.scaled(u.prior)
        reach = u.scaled(u.upper if moved > 0.0 else u.lower) - u.scaled(u.prior)
        if u.name in certain and abs(moved) >= AT_BOUND * abs(reach):
            names = " and ".join(final.effects)
            return f"{names} would do, but only with an improbable {u.name}, at its bound"
    for name in final.effects:
        for u in model.candidates[name].states:
            reach = IMPROBABLE_DEVIATIONS * (u.std or inf)
            if u.plain and all(abs(own[u.name] - u.prior) > reach for own in final.states):
                return f"{name} would do, but only with an improbable {u.name} in every run"
    return ""


def _without_regularity(explained: Explanation, decision: Decision) -> Decision:
    """The decision; unknown where what is left is no noise, and no small part of the gap.

    Another form of the law of an accepted effect leaves such a part.
    """
    for one in explained.regularities if decision.kind != "unknown" else ():
        if one.significant and one.squares > UNEXPLAINED_SHARE * explained.gained:
            reason = f"what is left of {one.channel} {one.what}"
            return replace(decision, kind="unknown", effects=(), reason=reason)
    return decision


def _decide_by_fits(model: Model, explained: Explanation) -> Decision:
    """Decide by what the fits with and without effects leave."""
    null, final = explained.null, explained.final
    if final.effects and adequate(final, null):
        moved = deviations(model, final)
        return Decision(kind="effect", effects=explained.named, deviations=moved, reason="")
    moved = deviations(model, null)
    if not final.effects and null.mean_square <= NULL_MEAN_SQUARE:
        kind: Kind = "parameter" if any(one.significant for one in moved) else "none"
        return Decision(kind=kind, effects=(), deviations=moved, reason="")
    reason = "no effect of the library, alone or with others, brings the residual to the noise"
    return Decision(kind="unknown", effects=(), deviations=moved, reason=reason)


def _is_structured(explained: Explanation) -> bool:
    """Whether a small residual has more Ljung-Box excess than was explained and than noise has.

    A fit that leaves more than the noise is judged by its squares instead.
    """
    null, final = explained.null, explained.final
    small = adequate(final, null) if final.effects else null.mean_square <= NULL_MEAN_SQUARE
    return small and final.ljung_box_excess > max(LJUNG_BOX_LIMIT, explained.gained)
