"""Detection limits of the effects in some runs, and the classes of collinear effects.

The signatures are those of the hypothesis tests: at the fit of a recorded run, or at the nominal
parameters for a run that is only planned. An effect is detectable from the size on at which the
norm of its signature, orthogonal to the nuisance parameters, reaches DETECTABLE_NORM. Two effects
are in one class where

    |cos(s_1, s_2)| > ALIKE_SIGNATURES   or   |s_1|^2 (1 - cos^2) < CLASS_MARGIN

s_1, s_2 : their orthogonal signatures at the plausible sizes, in the noise
A random effect has no signature that a fit could find again.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from plant_emulator.diagnosis.fitting.evidence import CLASS_MARGIN, DETECTABLE_NORM
from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.fitting.signature import SIGNATURE_SIZES, bounded_size, signature

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitValues
    from plant_emulator.diagnosis.fitting.signature import Signature
    from plant_emulator.diagnosis.machine import Candidate, Model

Value = TypeVar("Value")

ALIKE_SIGNATURES = 0.95


@dataclass(frozen=True, kw_only=True)
class DetectionLimit:
    """The detection limit of an effect in some runs.

    orthogonal_norm : norm of the signature at the plausible size, in the noise, without the part
        that a nuisance parameter can follow
    total_norm : norm of the whole signature
    smallest_size : size that reaches DETECTABLE_NORM, in plausible sizes; infinite where none does
    confounded_with : nuisance parameter that follows the signature most
    indistinguishable : the effect, then the effects that these runs cannot tell from it
    """

    effect: str
    orthogonal_norm: float
    total_norm: float
    smallest_size: float
    confounded_with: str
    indistinguishable: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class EffectDetectability:
    """The detection limit of an effect, its parameters by their names in the effect.

    smallest_size : sizes from which on the effect shows [`units`]; None: no size that was tried
    hidden_up_to : largest sizes that were tried and did not show, where larger ones are possible
    evidence_at_plausible_size : fall of chi squared that the effect would bring
    indistinguishable : the effect, then the effects that these runs cannot tell from it
    needs : what the runs lack to show the effect at its plausible size; None: nothing
    """

    effect: str
    subsystem: str
    smallest_size: Mapping[str, float | None]
    hidden_up_to: Mapping[str, float]
    units: Mapping[str, str]
    evidence_at_plausible_size: float
    indistinguishable: tuple[str, ...]
    needs: str | None

    def to_json(self) -> dict[str, Any]:
        """Write an entry of the document `detectability/1`."""
        return {
            "effect": self.effect,
            "subsystem": self.subsystem,
            "smallest_size": dict(self.smallest_size),
            "hidden_up_to": dict(self.hidden_up_to),
            "units": dict(self.units),
            "evidence_at_plausible_size": self.evidence_at_plausible_size,
            "class": list(self.indistinguishable),
            "needs": self.needs,
        }


def detection_limits(model: Model, where: FitValues, runs: Sequence[int]) -> list[DetectionLimit]:
    """Find what these runs can show of every effect, at a fit without effects."""
    tangents = NuisanceSpace(linearise(model, where, runs))
    found = {
        name: None if candidate.stochastic else signature(model, name, where, runs, tangents)
        for name, candidate in model.candidates.items()
    }
    seen = {name: s for name, s in found.items() if s is not None}
    return [
        DetectionLimit(
            effect=name,
            orthogonal_norm=0.0,
            total_norm=0.0,
            smallest_size=inf,
            confounded_with="",
            indistinguishable=(name,),
        )
        if s is None
        else DetectionLimit(
            effect=name,
            orthogonal_norm=s.orthogonal_norm,
            total_norm=s.total_norm,
            smallest_size=smallest(
                [
                    (allowed_factor(model.candidates[name], f), norm)
                    for f, norm in s.orthogonal_norms
                ]
            ),
            confounded_with=s.confounded_with,
            indistinguishable=alike(name, seen),
        )
        for name, s in found.items()
    ]


def smallest(norms: Sequence[tuple[float, float]]) -> float:
    """Size at which a signature reaches DETECTABLE_NORM: linear between the sizes tried, and to 0.

    norms : (size, norm), ascending in size; a limit that does not yet bite has the norm 0
    """
    size_before, norm_before = 0.0, 0.0
    for size, norm in norms:
        if norm >= DETECTABLE_NORM:
            share = (DETECTABLE_NORM - norm_before) / (norm - norm_before)
            return size_before + share * (size - size_before)
        size_before, norm_before = size, norm
    return inf


def allowed_factor(candidate: Candidate, factor: float) -> float:
    """Largest size up to `factor` that the bounds of an effect allow [plausible sizes]."""
    return max(
        (bounded_size(u, neutral, factor) - neutral) / (u.start - neutral)
        for u in candidate.sizes
        for neutral in (candidate.neutral[u.name],)
    )


def alike(name: str, seen: Mapping[str, Signature]) -> tuple[str, ...]:
    """Effects whose signature is that of `name`, the most alike first."""
    own = seen[name]
    if own.orthogonal_norm < DETECTABLE_NORM:
        return (name,)
    cosines = {
        other: abs(float(np.dot(own.direction, s.direction)))
        for other, s in seen.items()
        if other != name and s.orthogonal_norm >= DETECTABLE_NORM
    }
    near = [
        other
        for other, cosine in cosines.items()
        if cosine > ALIKE_SIGNATURES or own.orthogonal_norm**2 * (1.0 - cosine**2) < CLASS_MARGIN
    ]
    return (name, *sorted(near, key=lambda other: -cosines[other]))


def effect_detectability(found: DetectionLimit, candidate: Candidate) -> EffectDetectability:
    """Turn the limits of an effect into its own units."""
    seen = isfinite(found.smallest_size)
    least = {
        u.name: bounded_size(u, candidate.neutral[u.name], found.smallest_size) if seen else None
        for u in candidate.sizes
    }
    return EffectDetectability(
        effect=found.effect,
        subsystem=candidate.subsystem,
        smallest_size=_own_names(least, candidate),
        hidden_up_to={} if seen else _own_names(_hidden_up_to(found, candidate), candidate),
        units=_own_names(candidate.units, candidate),
        evidence_at_plausible_size=found.orthogonal_norm**2,
        indistinguishable=found.indistinguishable,
        needs=_needs(found, candidate),
    )


def _own_names(values: Mapping[str, Value], candidate: Candidate) -> dict[str, Value]:
    """Values by the names that the parameters have in their effect."""
    return {name.removeprefix(f"{candidate.name}_"): value for name, value in values.items()}


def _hidden_up_to(found: DetectionLimit, candidate: Candidate) -> dict[str, float]:
    """The largest sizes that were tried of an effect that acts, where its bounds allow more."""
    tried = {
        u.name: bounded_size(u, candidate.neutral[u.name], SIGNATURE_SIZES[-1])
        for u in candidate.sizes
    }
    ends = {u.name: bounded_size(u, candidate.neutral[u.name], inf) for u in candidate.sizes}
    return {
        name: value
        for name, value in tried.items()
        if found.total_norm > 0.0 and value != ends[name]
    }


def _needs(found: DetectionLimit, candidate: Candidate) -> str | None:
    """The sensor or manoeuvre that an effect lacks which does not show at its plausible size."""
    if found.orthogonal_norm >= DETECTABLE_NORM:
        return None
    if candidate.needs:
        return candidate.needs
    if found.total_norm >= DETECTABLE_NORM:
        return f"a run in which a deviation of {found.confounded_with} does not look the same"
    return "a run that excites it"
