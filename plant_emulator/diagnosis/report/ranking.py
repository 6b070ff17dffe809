"""The effects of an answer: the ranking by evidence, and the effects that do not show."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.answer import Quantity, RankedEffect, Undetectable
from plant_emulator.diagnosis.calibration.model_form_error import size_error
from plant_emulator.diagnosis.fitting.evidence import DETECTABLE_NORM, EVIDENCE_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation, Hypothesis
    from plant_emulator.diagnosis.machine import Candidate

# Effects that a ranking shows at least, whatever their evidence is.
SHOWN_EFFECTS = 5


def hypotheses_to_rank(explained: Explanation) -> list[Hypothesis]:
    """The effects to show, the best first: SHOWN_EFFECTS, and all that count or are accepted.

    An effect that is accepted beside another one may have little evidence alone.
    """
    order = sorted(explained.hypotheses, key=explained.evidence, reverse=True)
    counting = [c for c in order if explained.evidence(c) > EVIDENCE_THRESHOLD]
    shown = max(SHOWN_EFFECTS, len(counting))
    accepted = [c for c in order[shown:] if c.effect in explained.named]
    return [*order[:shown], *accepted]


def with_random_effects(explained: Explanation) -> FitResult:
    """The final fit with the sizes and shapes of the random effects."""
    values: dict[str, float] = {}
    for one in explained.random_effects:
        values |= {one.parameter: one.size, **one.shape}
    errors = {one.parameter: one.standard_error for one in explained.random_effects}
    final = explained.final
    return replace(
        final,
        values={**final.values, **values},
        standard_errors={**final.standard_errors, **errors},
    )


def ranked_effect(
    hypothesis: Hypothesis,
    explained: Explanation,
    accepted: Sequence[str],
    candidate: Candidate,
    *,
    gain: float | None = None,
    model_form_errors: Mapping[str, float] | None = None,
) -> RankedEffect:
    """One effect of the ranking; an accepted effect has its sizes from the final fit.

    gain : closed fraction with this effect alone; None: not predicted
    model_form_errors : relative, of every size by name; see `calibration.model_form_error`
    """
    name = hypothesis.effect
    fit = with_random_effects(explained) if name in accepted else hypothesis.fit
    sizes = () if fit is None else _sizes(fit, candidate, model_form_errors or {})
    return RankedEffect(
        effect=name,
        subsystem=candidate.subsystem,
        evidence=explained.evidence(hypothesis),
        held_out_gain=gain,
        parameters=tuple(sizes),
        accepted=name in accepted,
    )


def _sizes(
    fit: FitResult, candidate: Candidate, model_form_errors: Mapping[str, float]
) -> Iterator[Quantity]:
    """Sizes and shapes of an effect in a fit; the standard errors hold the model-form error."""
    usual = {u.name: abs(u.start - candidate.neutral[u.name]) for u in candidate.sizes}
    # Only the size of a random effect is estimated.
    shapes = () if candidate.stochastic else candidate.shapes
    for name in (u.name for u in (*candidate.sizes, *shapes)):
        value = fit.values[name]
        form_error = model_form_errors.get(name, 0.0)
        yield Quantity(
            name=name.removeprefix(f"{candidate.name}_"),
            value=value,
            standard_error=size_error(
                value - candidate.neutral.get(name, 0.0),
                fit.standard_errors[name],
                usual.get(name, 0.0),
                form_error,
            ),
            unit=candidate.units[name],
        )


def undetectable(
    explained: Explanation, candidates: Mapping[str, Candidate]
) -> tuple[Undetectable, ...]:
    """The effects that these logs could not show at their plausible size, and why."""
    return tuple(
        Undetectable(effect=c.effect, reason=reason_hidden(c, candidates[c.effect]))
        for c in explained.hypotheses
        if c.orthogonal_norm < DETECTABLE_NORM
        and c.effect not in explained.named
        and explained.evidence(c) <= EVIDENCE_THRESHOLD
    )


def reason_hidden(hypothesis: Hypothesis, candidate: Candidate) -> str:
    """Why an effect does not show, and what would show it."""
    if candidate.stochastic:
        return candidate.needs or "a random effect, too small to show in these logs"
    if hypothesis.total_norm < DETECTABLE_NORM:
        reason = "too small in these channels and runs at its plausible size"
    else:
        reason = f"a deviation of {hypothesis.confounded_with} looks the same"
    return f"{reason}; {candidate.needs}" if candidate.needs else reason
