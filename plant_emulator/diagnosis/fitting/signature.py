"""The signature of an effect: its response in the residual, and the part orthogonal to nuisance.

At a fit that lacks the effect, the effect comes in at several sizes, with everything else as
fitted. The signature is the change d of the whitened residual. Its orthogonal part is what no
nuisance parameter can follow (M. Basseville, I. Nikiforov, INRIA RR-4438, 2002; see
`nuisance_space`). The start states of the effect have their plausible values: values that suit the
residual of a fit would follow its noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitValues
    from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate, Unknown
    from plant_emulator.signals.log import Array

# Sizes that an effect is tried at [plausible sizes].
SIGNATURE_SIZES = (0.03, 0.1, 0.3, 0.6, 1.0, 2.0)


@dataclass(frozen=True, kw_only=True)
class Signature:
    """The response of the whitened residual of a fit to an effect that the fit lacks.

    total_norm : norm of the change at the plausible size
    orthogonal_norm : norm of its orthogonal part
    orthogonal_norms : size [plausible sizes] and norm of the orthogonal part, ascending in size
    confounded_with : nuisance parameter that follows the change most
    direction : orthogonal part over its norm, of all runs and channels
    """

    effect: str
    total_norm: float
    orthogonal_norm: float
    orthogonal_norms: tuple[tuple[float, float], ...]
    confounded_with: str
    direction: Array


def signature(
    model: Model, name: str, found: FitValues, runs: Sequence[int], nuisance: NuisanceSpace
) -> Signature | None:
    """Signature of an effect at a fit that lacks it; None where the effect changes nothing.

    nuisance : of the fit
    """
    changes = {
        size: _residual(model, name, found, runs, size) - nuisance.residual
        for size in SIGNATURE_SIZES
    }
    parts = {size: nuisance.orthogonal(change) for size, change in changes.items()}
    norms = {size: float(np.linalg.norm(part)) for size, part in parts.items()}
    if max(norms.values()) <= 1e-6:
        return None
    return Signature(
        effect=name,
        total_norm=float(np.linalg.norm(changes[1.0])),
        orthogonal_norm=norms[1.0],
        orthogonal_norms=tuple(norms.items()),
        confounded_with=_confounded_with(nuisance, changes[1.0]),
        direction=parts[1.0] / max(norms[1.0], 1e-12),
    )


def _residual(model: Model, name: str, found: FitValues, runs: Sequence[int], size: float) -> Array:
    """Residual of all runs with the effect at a size, everything else as fitted."""
    candidate, effects = model.candidates[name], (*found.effects, name)
    more = {u.name: u.start for u in candidate.states} | values_at_size(candidate, size)
    return np.concatenate(
        [
            model.residual(k, effects)({**found.values, **state, **more}).ravel()
            for k, state in zip(runs, found.states, strict=True)
        ]
    )


def _confounded_with(nuisance: NuisanceSpace, change: Array) -> str:
    """Name of the nuisance parameter or state that follows a change of the residual most."""
    follows = np.abs(nuisance.projection(change)) * _lengths(nuisance.estimate)
    return nuisance.estimate.unknowns[int(np.argmax(follows))].name


def _lengths(found: Estimate) -> Array:
    """Norm of each column of the Jacobian: the change of the residual by a unit of z."""
    return np.asarray(np.sqrt(np.diag(found.information)))


def values_at_size(candidate: Candidate, size: float, only: str | None = None) -> dict[str, float]:
    """Sizes and shapes of an effect at a size [plausible sizes from neutral].

    only : the size parameter that is set, with the others neutral; None: all are set
    """
    sizes = {
        u.name: bounded_size(u, candidate.neutral[u.name], size if only in (None, u.name) else 0.0)
        for u in candidate.sizes
    }
    return sizes | {u.name: u.start for u in candidate.shapes}


def signs(sizes: Sequence[Unknown]) -> tuple[float, ...]:
    """Signs that an effect of these size parameters may have: both where a bound allows both."""
    return (1.0, -1.0) if any(u.lower < 0.0 < u.upper for u in sizes) else (1.0,)


def bounded_size(unknown: Unknown, neutral: float, factor: float) -> float:
    """Size parameter at so many plausible sizes from neutral, within its bounds [its unit]."""
    value = neutral + factor * (unknown.start - neutral)
    return float(np.clip(value, unknown.lower, unknown.upper))
