"""The signature of an effect: what it does to the residual, and what of that nothing else can do.

At a fit that lacks the effect, the effect comes in at several sizes, with everything else as
fitted. The signature is the change d of the whitened residual r. Its orthogonal part s is what no
nuisance parameter can follow (M. Basseville, I. Nikiforov, INRIA RR-4438, 2002; see
`nuisance_space`). The linear picture expects the sum of squares to fall by

    gain = |r|^2 - |r + s|^2

The size of the largest gain is where a joint fit of the effect starts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.nuisance_space import gain_along, gain_at_best_angle
from plant_emulator.estimation.robust_scan import combinations

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitValues
    from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate, Unknown
    from plant_emulator.signals.log import Array

# Sizes that an effect is tried at [plausible sizes]. The first SMALL_SIZES of them show its sign.
SIZES = (0.03, 0.1, 0.3, 0.6, 1.0, 2.0)
SMALL_SIZES = 2
# A second start has at least this size [plausible sizes].
FAR = 0.3
# Sizes that each size parameter of several is tried at alone [plausible sizes].
ALONE = (0.3, 1.0, 2.0)
# A change of the residual of this norm is not hidden by the noise. A change is concentrated where
# it amounts to fewer than FEW_SAMPLES samples of equal squares.
RESOLVED_NORM, FEW_SAMPLES = 2.0, 30.0

# Values by name, and the states of each run by name: where a fit may start.
Start = tuple["Mapping[str, float]", "tuple[Mapping[str, float], ...]"]


@dataclass(frozen=True, kw_only=True)
class Signature:
    """What an effect does to the whitened residual of a fit that lacks it.

    start, states : values, and states of each run, from which a joint fit may start
    far : the same start at a larger size; None: there is none
    total_norm : norm of the change at the plausible size
    orthogonal_norm : norm of its orthogonal part
    gain : fall of the sum of squares that the linear picture expects at the best size
    concentrated : whether the orthogonal part sits in a few samples already at the smallest size,
        as where a contact begins a little earlier; nuisance parameters may follow it all the same
    orthogonal_norms : size [plausible sizes] and norm of the orthogonal part, ascending in size
    confounded_with : nuisance parameter that follows the change most
    direction : orthogonal part over its norm, of all runs and channels
    """

    effect: str
    start: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]
    far: Start | None
    orthogonal_norm: float
    total_norm: float
    gain: float
    concentrated: bool
    orthogonal_norms: tuple[tuple[float, float], ...]
    confounded_with: str
    direction: Array


def signature(
    model: Model, name: str, found: FitValues, runs: Sequence[int], nuisance: NuisanceSpace
) -> Signature | None:
    """Signature of an effect at a fit that lacks it; None where the effect changes nothing.

    nuisance : of the fit
    """
    effect = _Effect(model, model.candidates[name], found, tuple(runs), nuisance)
    trials = effect.trials()
    moving = [trial for trial in trials if trial.norm > 1e-6]
    if not moving:
        return None
    # A limit that is not reached does next to nothing at small sizes: no fit starts there.
    moving = [trial for trial in moving if trial.is_resolved] or moving
    best = max(moving, key=lambda trial: trial.gain)
    beyond = [t for t in moving if t.size / best.size > 1.0 and abs(t.size) >= FAR]
    larger = min(beyond, key=lambda trial: abs(trial.size), default=None)
    best = max([best, *effect.trials_alone()], key=lambda trial: trial.gain)
    plausible = next(t for t in trials if abs(t.size) == 1.0)
    values, states = effect.start(best)
    return Signature(
        effect=name,
        start=values,
        states=states,
        far=None if larger is None else effect.start(larger),
        orthogonal_norm=plausible.norm,
        total_norm=float(np.linalg.norm(plausible.change)),
        gain=best.gain,
        concentrated=any(t.is_concentrated for t in trials if abs(t.size) == SIZES[0]),
        orthogonal_norms=tuple(
            (abs(t.size), t.norm) for t in trials if t.size * plausible.size > 0.0
        ),
        confounded_with=_confounded_with(nuisance, plausible.change),
        direction=plausible.orthogonal / max(plausible.norm, 1e-12),
    )


def _confounded_with(nuisance: NuisanceSpace, change: Array) -> str:
    """Name of the nuisance parameter or state that follows a change of the residual most."""
    follows = np.abs(nuisance.projection(change)) * _lengths(nuisance.estimate)
    return nuisance.estimate.unknowns[int(np.argmax(follows))].name


def _lengths(found: Estimate) -> Array:
    """Norm of each column of the Jacobian: the change of the residual by a unit of z."""
    return np.asarray(np.sqrt(np.diag(found.information)))


@dataclass(frozen=True, kw_only=True)
class _Trial:
    """An effect at one size [plausible sizes].

    values : of its sizes and shapes; change : of the residual; orthogonal : its orthogonal part
    norm : of the orthogonal part; gain : see the module's text
    """

    size: float
    values: Mapping[str, float]
    change: Array
    orthogonal: Array
    norm: float
    gain: float

    @property
    def is_resolved(self) -> bool:
        """Whether the noise does not hide the change."""
        return float(np.linalg.norm(self.change)) > RESOLVED_NORM

    @property
    def is_concentrated(self) -> bool:
        """Whether the orthogonal part is well above the noise and sits in a few samples."""
        square = float(self.orthogonal @ self.orthogonal)
        fourth = float(np.sum(self.orthogonal**4))
        return square > RESOLVED_NORM**2 and square**2 < FEW_SAMPLES * fourth


@dataclass(frozen=True)
class _Effect:
    """An effect that comes in at a fit that lacks it."""

    model: Model
    candidate: Candidate
    found: FitValues
    runs: tuple[int, ...]
    nuisance: NuisanceSpace

    def trials(self) -> list[_Trial]:
        """The effect at all sizes; at the larger ones in the sign whose small sizes gain more."""
        small, large = SIZES[:SMALL_SIZES], SIZES[SMALL_SIZES:]
        by_sign = {
            sign: [self.trial(sign * size) for size in small]
            for sign in signs(self.candidate.sizes)
        }
        better = max(by_sign, key=lambda sign: max(trial.gain for trial in by_sign[sign]))
        both = [trial for trials in by_sign.values() for trial in trials]
        return [*both, *(self.trial(better * size) for size in large)]

    def trials_alone(self) -> list[_Trial]:
        """Each of several size parameters, with the others neutral.

        What one parameter does at a wrong value hides what another one explains.
        """
        if len(self.candidate.sizes) == 1:
            return []
        return [
            self.trial(sign * size, only=u.name)
            for u in self.candidate.sizes
            for sign in signs([u])
            for size in ALONE
        ]

    def trial(self, size: float, only: str | None = None) -> _Trial:
        """The effect at one size; only : see `values_at_size`."""
        residual = self.nuisance.residual
        values = values_at_size(self.candidate, size, only)
        change = self.residual(values, self.own_states) - residual
        orthogonal = self.nuisance.orthogonal(change)
        after = residual + orthogonal
        return _Trial(
            size=size,
            values=values,
            change=change,
            orthogonal=orthogonal,
            norm=float(np.linalg.norm(orthogonal)),
            gain=float(residual @ residual - after @ after),
        )

    def residual(self, values: Mapping[str, float], own: Sequence[Mapping[str, float]]) -> Array:
        """Residual of all runs with the effect, everything else as fitted.

        values : of its sizes and shapes; own : its states in each run
        """
        found, effects = self.found, (*self.found.effects, self.candidate.name)
        return np.concatenate(
            [
                self.model.residual(k, effects)({**found.values, **state, **more, **values}).ravel()
                for k, state, more in zip(self.runs, found.states, own, strict=True)
            ]
        )

    def start(self, trial: _Trial) -> Start:
        """Values and states with the effect at a size, the nuisance parameters moved with it."""
        shift = self.nuisance.projection(trial.change)
        values, states = self.nuisance.shifted(shift, len(self.runs))
        return {**values, **trial.values}, tuple(
            {**state, **own} for state, own in zip(states, self.own_states, strict=True)
        )

    @cached_property
    def own_states(self) -> list[dict[str, float]]:
        """The effect's states in each run: those whose small signature gains most there.

        A fit from a wrong angle or temperature at the start ends anywhere. All states are tried
        together; three values of an angle tell the others.
        """
        if not self.candidate.states:
            return [{} for _ in self.runs]
        residual = self.nuisance.residual
        found: list[list[tuple[float, dict[str, float]]]] = [[] for _ in self.runs]
        for state, angle in combinations(self.candidate.states):
            if angle is None:
                for k, part in enumerate(self._small_parts(state)):
                    found[k].append((gain_along(part, residual), state))
                continue
            turned = [self._small_parts({**state, angle: value}) for value in (0.0, pi / 2, pi)]
            for k, (zero, quarter, half) in enumerate(zip(*turned, strict=True)):
                gain, best = gain_at_best_angle(zero, quarter, half, residual)
                found[k].append((gain, {**state, angle: best}))
        return [max(trials, key=lambda one: one[0])[1] for trials in found]

    def _small_parts(self, state: Mapping[str, float]) -> list[Array]:
        """Orthogonal part of each run's small signature with this state."""
        residual = self.residual(self._small_values, [state] * len(self.runs))
        return self.nuisance.orthogonal_by_run(residual - self.nuisance.residual)

    @cached_property
    def _small_values(self) -> dict[str, float]:
        """Sizes and shapes of the effect at a small size, to find its states by.

        Of several size parameters only the one that its states change most: what the others do
        hides which states are right.
        """
        candidate = self.candidate
        every = [values_at_size(candidate, SIZES[1], only=size.name) for size in candidate.sizes]
        return every[0] if len(every) == 1 else max(every, key=self._sensitivity_to_states)

    def _sensitivity_to_states(self, values: Mapping[str, float]) -> float:
        """Norm of the change of the residual between two choices of all states."""
        here, there = (
            self.residual(
                values,
                [{u.name: u.start + shift * u.scale for u in self.candidate.states}]
                * len(self.runs),
            )
            for shift in (0.0, 1.0)
        )
        return float(np.linalg.norm(there - here))


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
