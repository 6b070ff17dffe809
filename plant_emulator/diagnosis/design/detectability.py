"""Beforehand: what a run can show of each effect, and what it cannot tell apart.

From the same signatures as the contest, at a run's own fit or, for a run that is only planned, at
the nominal parameters: the drift-free signature of an effect at its plausible size, in the noise.
An effect is detectable from the size on at which its signature reaches DETECTABLE; two effects are
of one class where the cosine between their signatures is above ALIKE, or where the evidence that
separates them at their plausible sizes is under MARGIN. An effect whose course in a run is chance
has no signature that a fit could find again.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.diagnosis.fitting.evidence import DETECTABLE, MARGIN
from plant_emulator.diagnosis.fitting.joint_fit import linearised
from plant_emulator.diagnosis.fitting.nuisance_space import Tangents
from plant_emulator.diagnosis.fitting.signature import SIZES, bounded, signature

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.signature import Signature
    from plant_emulator.diagnosis.machine import Candidate, Model

ALIKE = 0.95


@dataclass(frozen=True, kw_only=True)
class Detectability:
    """What these runs can show of an effect.

    norm : drift-free signature at the plausible size, in the noise; raw : without removing drift
    smallest : size that reaches DETECTABLE, in plausible sizes; infinite: none does
    alike : effects that they cannot tell from it, itself first
    """

    effect: str
    norm: float
    raw: float
    smallest: float
    imitated_by: str
    alike: tuple[str, ...]


def detectability(model: Model, where: FitResult, runs: Sequence[int]) -> list[Detectability]:
    """For every effect of the library, at a fit without effects."""
    tangents = Tangents(linearised(model, where, runs))
    found = {
        name: None if candidate.untold else signature(model, name, where, runs, tangents)
        for name, candidate in model.candidates.items()
    }
    seen = {name: s for name, s in found.items() if s is not None}
    return [
        Detectability(effect=name, norm=0.0, raw=0.0, smallest=inf, imitated_by="", alike=(name,))
        if s is None
        else Detectability(
            effect=name,
            norm=s.norm,
            raw=s.raw,
            smallest=smallest([(reached(model.candidates[name], f), norm) for f, norm in s.norms]),
            imitated_by=s.imitated_by,
            alike=alike(name, seen),
        )
        for name, s in found.items()
    ]


def smallest(norms: Sequence[tuple[float, float]]) -> float:
    """Size at which a signature reaches DETECTABLE: linear between the sizes tried, and to 0.

    norms : (size, norm), ascending in size; a limit that does not yet bite has the norm 0
    """
    size_before, norm_before = 0.0, 0.0
    for size, norm in norms:
        if norm >= DETECTABLE:
            share = (DETECTABLE - norm_before) / (norm - norm_before)
            return size_before + share * (size - size_before)
        size_before, norm_before = size, norm
    return inf


def reached(candidate: Candidate, factor: float) -> float:
    """What of so many plausible sizes the bounds of an effect leave, in plausible sizes."""
    return max(
        (bounded(u, neutral, factor) - neutral) / (u.start - neutral)
        for u in candidate.sizes
        for neutral in (candidate.neutral[u.name],)
    )


def alike(name: str, seen: Mapping[str, Signature]) -> tuple[str, ...]:
    """Effects whose signature is that of `name`, the most alike first."""
    own = seen[name]
    if own.norm < DETECTABLE:
        return (name,)
    cosines = {
        other: abs(float(np.dot(own.direction, s.direction)))
        for other, s in seen.items()
        if other != name and s.norm >= DETECTABLE
    }
    near = [
        other
        for other, cosine in cosines.items()
        if cosine > ALIKE or own.norm**2 * (1.0 - cosine**2) < MARGIN
    ]
    return (name, *sorted(near, key=lambda other: -cosines[other]))


def as_answer(found: Detectability, candidate: Candidate) -> dict[str, Any]:
    """One entry of the answer, schema detectability/1."""
    prefix = f"{candidate.name}_"
    seen = isfinite(found.smallest)
    least = {
        u.name.removeprefix(prefix): (
            bounded(u, candidate.neutral[u.name], found.smallest) if seen else None
        )
        for u in candidate.sizes
    }
    return {
        "effect": found.effect,
        "subsystem": candidate.subsystem,
        "smallest_size": least,
        "hidden_up_to": {} if seen else _hidden_up_to(found, candidate),
        "units": {k.removeprefix(prefix): v for k, v in candidate.units.items()},
        "evidence_at_plausible_size": found.norm**2,
        "class": list(found.alike),
        "needs": _needs(found, candidate),
    }


def _hidden_up_to(found: Detectability, candidate: Candidate) -> dict[str, float]:
    """The largest sizes that were tried of an effect that acts, where its bounds allow more."""
    tried = {u.name: bounded(u, candidate.neutral[u.name], SIZES[-1]) for u in candidate.sizes}
    ends = {u.name: bounded(u, candidate.neutral[u.name], inf) for u in candidate.sizes}
    return {
        name.removeprefix(f"{candidate.name}_"): value
        for name, value in tried.items()
        if found.raw > 0.0 and value != ends[name]
    }


def _needs(found: Detectability, candidate: Candidate) -> str | None:
    """What is missing for an effect that does not show at its plausible size."""
    if found.norm >= DETECTABLE:
        return None
    if candidate.needs:
        return candidate.needs
    if found.raw >= DETECTABLE:
        return f"a run in which drift of {found.imitated_by} does not look the same"
    return "a run that excites it"
