"""The signature of an effect: what it does to a residual that drift cannot imitate.

The residual's change when the effect comes in at some size, all else as fitted, less its part along
the tangents of the drifting parameters (Basseville and Nikiforov, INRIA RR-4438, 2002).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.nuisance_space import gain_along, gain_at_best_angle
from plant_emulator.estimation.robust_scan import combinations

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
    from plant_emulator.diagnosis.machine import Candidate, Model
    from plant_emulator.estimation.unknowns import Estimate, Unknown
    from plant_emulator.signals.log import Array

# Sizes at which a signature is tried, in plausible sizes.
SIZES = (0.03, 0.1, 0.3, 0.6, 1.0, 2.0)
# The first so many of them show in which direction.
SMALL_SIZES = 2
# From which of these on a fit may begin besides the best one.
FAR = 0.3
# And those at which each size of several is tried alone.
ALONE = (0.3, 1.0, 2.0)
# Norm of a change of the residual that the noise does not hide, and the samples, of equal squares,
# that are few.
RESOLVED, FEW_SAMPLES = 2.0, 30.0


@dataclass(frozen=True, kw_only=True)
class Signature:
    """What an effect does to the whitened residual of a fit that lacks it.

    start : where a joint fit may begin, by name; states : the same of every run
    far : the same at a larger size, if there is one
    norm : of the part that drift cannot imitate, at the plausible size
    raw : of the whole, at the plausible size
    gain : fall of the sum of squares that the linear picture expects at the best size
    concentrated : whether that part sits in a few samples already at the smallest size, as where a
        contact begins a little earlier: drift may follow there all the same, not in proportion
    imitated_by : the parameter that follows it most
    norms : of the part that drift cannot imitate, by size in plausible sizes, ascending, in one
        direction
    direction : the part that drift cannot imitate over its norm, all runs and channels
    """

    effect: str
    start: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]
    far: tuple[Mapping[str, float], tuple[Mapping[str, float], ...]] | None
    orthogonal_norm: float
    total_norm: float
    gain: float
    concentrated: bool
    orthogonal_norms: tuple[tuple[float, float], ...]
    confounded_with: str
    direction: Array


def signature(
    model: Model, name: str, where: FitResult, runs: Sequence[int], tangents: NuisanceSpace
) -> Signature | None:
    """The signature of an effect at a fit that lacks it; None: it changes nothing there."""
    own = _own_states(model, name, where, runs, tangents)
    tried = partial(_trial, model, name, where, runs, tangents, own)
    trials = _trials(tried, signs(model.candidates[name].sizes))
    moving = [trial for trial in trials if trial.norm > 1e-6]
    if not moving:
        return None
    # A limit that is not reached does next to nothing at small sizes: no fit begins there.
    moving = [trial for trial in moving if _shows(trial)] or moving
    best = max(moving, key=lambda trial: trial.gain)
    beyond = [t for t in moving if t.size / best.size > 1.0 and abs(t.size) >= FAR]
    larger = min(beyond, key=lambda trial: abs(trial.size), default=None)
    best = max([best, *_alone(tried, model.candidates[name])], key=lambda trial: trial.gain)
    plausible = next(t for t in trials if abs(t.size) == 1.0)
    values, states = _start(best, tangents, own)
    names = [u.name for u in tangents.estimate.unknowns]
    follows = np.abs(tangents.projection(plausible.change)) * _lengths(tangents.estimate)
    return Signature(
        effect=name,
        start=values,
        states=states,
        far=None if larger is None else _start(larger, tangents, own),
        orthogonal_norm=plausible.norm,
        total_norm=float(np.linalg.norm(plausible.change)),
        gain=best.gain,
        concentrated=any(_concentrated(t.rest) for t in trials if abs(t.size) == SIZES[0]),
        orthogonal_norms=tuple(
            (abs(t.size), t.norm) for t in trials if t.size * plausible.size > 0.0
        ),
        confounded_with=names[int(np.argmax(follows))],
        direction=plausible.rest / max(plausible.norm, 1e-12),
    )


def _shows(trial: _Trial) -> bool:
    """Whether a size changes the residual by more than the noise hides."""
    return float(np.linalg.norm(trial.change)) > RESOLVED


def _concentrated(rest: Array) -> bool:
    """Whether a change well above the noise sits in a few samples."""
    square = float(rest @ rest)
    return square > RESOLVED**2 and square**2 < FEW_SAMPLES * float(np.sum(rest**4))


def _own_states(
    model: Model, name: str, where: FitResult, runs: Sequence[int], tangents: NuisanceSpace
) -> list[dict[str, float]]:
    """An effect's states of every run: those whose small signature explains most of that run.

    Where an angle or a temperature at the start is unknown, a fit from a wrong one ends anywhere.
    All are tried together; of an angle three values tell the rest.
    """
    candidate = model.candidates[name]
    if not candidate.states:
        return [{} for _ in runs]
    sizes = _size_to_find_states(model, candidate, where, runs)

    def parts(state: Mapping[str, float]) -> list[Array]:
        """What each run's small signature with this state leaves that drift cannot imitate."""
        residual = _residual(model, candidate, where, runs, [state] * len(runs), sizes)
        return tangents.orthogonal_by_run(residual - tangents.residual)

    found: list[list[tuple[float, dict[str, float]]]] = [[] for _ in runs]
    for state, angle in combinations(candidate.states):
        if angle is None:
            for k, part in enumerate(parts(state)):
                found[k].append((gain_along(part, tangents.residual), state))
            continue
        turned = [parts({**state, angle: value}) for value in (0.0, pi / 2, pi)]
        for k, (ahead, aside, behind) in enumerate(zip(*turned, strict=True)):
            gain, best = gain_at_best_angle(ahead, aside, behind, tangents.residual)
            found[k].append((gain, {**state, angle: best}))
    return [max(trials, key=lambda one: one[0])[1] for trials in found]


def _size_to_find_states(
    model: Model, candidate: Candidate, where: FitResult, runs: Sequence[int]
) -> dict[str, float]:
    """An effect at a small size to find its states by; of several sizes only that one which goes
    with them, for what the others do hides which states are right.
    """
    every = [sized(candidate, SIZES[1], only=size.name) for size in candidate.sizes]
    if len(every) == 1:
        return every[0]
    states = [{u.name: u.start + shift * u.scale for u in candidate.states} for shift in (0.0, 1.0)]

    def moved(sizes: Mapping[str, float]) -> float:
        """How much other states change."""
        here, there = (
            _residual(model, candidate, where, runs, [state] * len(runs), sizes) for state in states
        )
        return float(np.linalg.norm(there - here))

    return max(every, key=moved)


def _start(
    trial: _Trial, tangents: NuisanceSpace, own: Sequence[Mapping[str, float]]
) -> tuple[dict[str, float], tuple[dict[str, float], ...]]:
    """Values and states with the effect at a size, and the drift moved as it would imitate it."""
    values, states = tangents.shifted(tangents.projection(trial.change), len(own))
    return {**values, **trial.sizes}, tuple(
        {**state, **more} for state, more in zip(states, own, strict=True)
    )


def _lengths(found: Estimate) -> Array:
    """Length of each column of the Jacobian: what a unit of z moves in the residual."""
    return np.asarray(np.sqrt(np.diag(found.information)))


@dataclass(frozen=True, kw_only=True)
class _Trial:
    size: float
    sizes: Mapping[str, float]
    change: Array
    rest: Array
    norm: float
    gain: float


def _trials(tried: Callable[[float], _Trial], directions: Sequence[float]) -> list[_Trial]:
    """The effect at all sizes, in the direction whose small sizes explain more; those in both."""
    small, large = SIZES[:SMALL_SIZES], SIZES[SMALL_SIZES:]
    found = {sign: [tried(sign * size) for size in small] for sign in directions}
    better = max(found, key=lambda sign: max(trial.gain for trial in found[sign]))
    both = [trial for trials in found.values() for trial in trials]
    return [*both, *(tried(better * size) for size in large)]


def _alone(tried: Callable[..., _Trial], candidate: Candidate) -> list[_Trial]:
    """Each size of an effect that has several, while the others are neutral: what one does at a
    wrong value hides what another explains.
    """
    if len(candidate.sizes) == 1:
        return []
    return [
        tried(sign * size, only=u.name)
        for u in candidate.sizes
        for sign in signs([u])
        for size in ALONE
    ]


def _trial(
    model: Model,
    name: str,
    where: FitResult,
    runs: Sequence[int],
    tangents: NuisanceSpace,
    own: Sequence[Mapping[str, float]],
    size: float,
    only: str | None = None,
) -> _Trial:
    """The effect at one size, in plausible sizes; own : its states of every run; only : see
    `sized`.
    """
    candidate = model.candidates[name]
    sizes = sized(candidate, size, only)
    change = _residual(model, candidate, where, runs, own, sizes) - tangents.residual
    rest = tangents.orthogonal(change)
    after = tangents.residual + rest
    return _Trial(
        size=size,
        sizes=sizes,
        change=change,
        rest=rest,
        norm=float(np.linalg.norm(rest)),
        gain=float(tangents.residual @ tangents.residual - after @ after),
    )


def _residual(
    model: Model,
    candidate: Candidate,
    where: FitResult,
    runs: Sequence[int],
    own: Sequence[Mapping[str, float]],
    sizes: Mapping[str, float],
) -> Array:
    """Residual of all runs with one more effect, all else as fitted."""
    effects = (*where.effects, candidate.name)
    return np.concatenate(
        [
            model.residual(k, effects)({**where.values, **state, **more, **sizes}).ravel()
            for k, state, more in zip(runs, where.states, own, strict=True)
        ]
    )


def sized(candidate: Candidate, size: float, only: str | None = None) -> dict[str, float]:
    """Sizes, in plausible sizes from neutral, and shapes of an effect; only : of its sizes, while
    the others are neutral.
    """
    sizes = {
        u.name: bounded(u, candidate.neutral[u.name], size if only in (None, u.name) else 0.0)
        for u in candidate.sizes
    }
    return sizes | {u.name: u.start for u in candidate.shapes}


def signs(sizes: Sequence[Unknown]) -> tuple[float, ...]:
    """Both directions where the bounds allow an effect in both."""
    return (1.0, -1.0) if any(u.lower < 0.0 < u.upper for u in sizes) else (1.0,)


def bounded(unknown: Unknown, neutral: float, factor: float) -> float:
    """A size in plausible sizes from neutral, within its bounds."""
    value = neutral + factor * (unknown.start - neutral)
    return float(np.clip(value, unknown.lower, unknown.upper))
