"""The contest between effects: which one, fitted with everything that may drift, is needed.

 1. One converged fit without effects.
 2. For each effect its signature: the residual's change when the effect comes in at some size, all
    else as fitted; and what of that the drifting parameters cannot imitate (the part orthogonal to
    their tangents: Basseville and Nikiforov, nuisance rejection).
 3. A joint fit of drift and effect, started from the size whose signature explains most, the drift
    moved by what the linear picture says.
 4. The fit without effects starts again from every joint fit's drift: should it get as low, there
    was no effect, only a better valley.
Evidence is the fall of the penalised sum of squares, times the share of samples that are
independent (the residual's autocorrelation time).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation import Estimate, estimate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.estimation import Array, Unknown

# Relative fall of the cost that ends a fit here: a few hundredths in units of chi squared.
SETTLED = 1e-6
# Sizes at which a signature is tried, in plausible sizes.
SIZES = (0.1, 0.3, 1.0, 2.0)


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """A joint fit; cost : sum of squares with the priors."""

    effects: tuple[str, ...]
    estimate: Estimate

    @property
    def cost(self) -> float:
        """Sum of squares of residuals and priors."""
        return self.estimate.cost + self.estimate.penalty

    @property
    def chi_squared(self) -> float:
        """Mean square of the whitened residual."""
        return self.estimate.cost / self.estimate.samples


def template(model: Model, effects: Sequence[str], runs: Sequence[int]) -> list[Unknown]:
    """All unknowns of a joint fit: drift, effects, states of every run (numbered from 0)."""
    own = [model.candidates[name] for name in effects]
    states = (*model.states, *(u for c in own for u in c.states))
    shared = (*model.parameters, *(u for c in own for u in (*c.sizes, *c.shapes)))
    return [*shared, *(replace(u, run=k) for k in range(len(runs)) for u in states)]


def started(
    unknowns: Sequence[Unknown], values: Mapping[str, float], states: Sequence[Mapping[str, float]]
) -> list[Unknown]:
    """The unknowns, starting at these values where there are such."""
    return [
        replace(u, start=(values if u.run is None else states[u.run]).get(u.name, u.start))
        for u in unknowns
    ]


def fit(
    model: Model,
    effects: Sequence[str],
    runs: Sequence[int],
    values: Mapping[str, float],
    states: Sequence[Mapping[str, float]],
) -> Fitted:
    """Joint fit of drift, states and these effects, from these values."""
    unknowns = started(template(model, effects, runs), values, states)
    residuals = [model.residual(k, effects) for k in runs]
    return Fitted(effects=tuple(effects), estimate=estimate(unknowns, residuals, settled=SETTLED))


def again(model: Model, effects: Sequence[str], runs: Sequence[int], start: Fitted) -> Fitted:
    """Joint fit with these effects from where another fit has come to."""
    states = [start.estimate.states(k) for k in range(len(runs))]
    return fit(model, effects, runs, start.estimate.parameters(), states)


def null_fit(model: Model, runs: Sequence[int]) -> Fitted:
    """The fit without effects, from the model's own search."""
    values, states = model.search(runs)
    return fit(model, (), runs, values, states)


@dataclass(frozen=True, kw_only=True)
class Signature:
    """What an effect does to the whitened residual of a fit that lacks it.

    sizes : of the effect, by name; shift : of the fit's z that the linear picture expects
    norm : of the part that drift cannot imitate; gain : fall of the sum of squares expected
    direction : that part over its norm, all runs and channels in one vector
    """

    sizes: Mapping[str, float]
    shift: Array
    norm: float
    gain: float
    direction: Array


class Tangents:
    """The drift's tangent space at a fit, for removing from signatures what drift can imitate."""

    def __init__(self, fitted: Fitted) -> None:
        estimate = fitted.estimate
        p = len(estimate.z)
        self.residual = np.concatenate([r.ravel() for r in estimate.residuals])
        self._slopes = np.concatenate([j.reshape(-1, p) for j in estimate.jacobians])
        precision = np.diag([u.scaled_std**-2.0 for u in estimate.unknowns])
        hessian = estimate.information + precision
        self._inverse = np.linalg.pinv(hessian, hermitian=True)

    def imitation(self, signature: Array) -> Array:
        """Shift of z that follows a change of the residual best."""
        return -self._inverse @ (self._slopes.T @ signature)

    def rest(self, signature: Array) -> Array:
        """The change of the residual that remains when drift follows it."""
        return signature + self._slopes @ self.imitation(signature)


def signature(
    model: Model, name: str, base: Fitted, runs: Sequence[int], tangents: Tangents
) -> Signature | None:
    """The signature of an effect at the size that explains most; None: it changes nothing."""
    candidate = model.candidates[name]
    effects = (*base.effects, name)
    residuals = [model.residual(k, effects) for k in runs]
    best: Signature | None = None
    for factor in SIZES:
        for sign in signs(candidate.sizes):
            sizes = {
                u.name: bounded(u, candidate.neutral[u.name], sign * factor)
                for u in candidate.sizes
            }
            shapes = {u.name: u.start for u in candidate.shapes}
            starts = {u.name: u.start for u in candidate.states}
            changed = np.concatenate(
                [
                    residuals[i](
                        {
                            **base.estimate.parameters(),
                            **base.estimate.states(i),
                            **starts,
                            **sizes,
                            **shapes,
                        }
                    ).ravel()
                    for i in range(len(runs))
                ]
            )
            change = changed - tangents.residual
            rest = tangents.rest(change)
            norm = float(np.linalg.norm(rest))
            if norm < 1e-9:
                continue
            after = tangents.residual + rest
            gain = float(tangents.residual @ tangents.residual - after @ after)
            if best is None or gain > best.gain:
                best = Signature(
                    sizes=sizes,
                    shift=tangents.imitation(change),
                    norm=norm,
                    gain=gain,
                    direction=rest / norm,
                )
    return best


def signs(sizes: Sequence[Unknown]) -> tuple[float, ...]:
    """Both directions where the bounds allow an effect in both."""
    return (1.0, -1.0) if any(u.lower < 0.0 < u.upper for u in sizes) else (1.0,)


def bounded(unknown: Unknown, neutral: float, factor: float) -> float:
    """A size in plausible sizes from neutral, within its bounds."""
    value = neutral + factor * (unknown.start - neutral)
    return float(np.clip(value, unknown.lower, unknown.upper))
