"""The columns of an effect at one size, and what they gain.

Each size parameter has a column of its own. Where an angle is unknown, each run has a cosine and a
sine column.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.signature import signs, values_at_size
from plant_emulator.diagnosis.screening.simulation_columns import HIDDEN_NORM
from plant_emulator.estimation.regression import gain

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from plant_emulator.diagnosis.fidelity import Fidelity
    from plant_emulator.diagnosis.machine import Candidate
    from plant_emulator.diagnosis.screening.simulation_columns import SimulationColumns
    from plant_emulator.estimation.unknowns import Unknown
    from plant_emulator.signals.log import Array

    States = Sequence[Mapping[str, float]]
    # Change of the data by a size parameter, or by all where there is one, at a size [plausible
    # sizes] and in these states; None: it cannot be simulated.
    Change = Callable[[str | None, float, States], Array | None]


# Trials of a size that a limit begins to act at, and the share of it that is close enough.
TRIALS, CLOSE = 6, 0.7


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of an effect: change of the data at one size.

    size : the size parameter's name; run : of a column with an angle, else None
    """

    size: str
    run: int | None
    change: Array


@dataclass(frozen=True, kw_only=True)
class Score:
    """The gain of an effect in one linear regression, by its columns at a size.

    gain : of log evidence
    factor : size that the regression finds, over that of the columns [1]
    values, states : of the effect, and of each run, where a fit may start
    theta : nuisance coefficients there
    """

    gain: float
    factor: float
    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]
    theta: Array


def best_score(
    fidelity: Fidelity, candidate: Candidate, sizes: Sequence[float], states: States
) -> Score | None:
    """Score of an effect at the size that gains most; None: it shows nothing here.

    states : of the effect in each run, but for an angle
    """
    return _best(fidelity, candidate, sizes, states, _change(fidelity, candidate))


def faint_score(
    simulation: SimulationColumns, candidate: Candidate, states: States
) -> Score | None:
    """Score of an effect by its slopes where it is absent; see `SimulationColumns.slope`.

    The slope of a size with many narrow basins tells nothing of another basin, and that of a
    one-sided size nothing of its other side. None: it shows nothing
    """

    def change(only: str | None, size: float, states: States) -> Array:
        unknown = next(u for u in candidate.sizes if only in {None, u.name})
        at = values_at_size(candidate, size, only)[unknown.name]
        if unknown.step is not None or at == candidate.neutral[unknown.name]:
            return np.zeros_like(simulation.base)
        return size * simulation.slope(candidate.name, unknown.name, states)

    return _best(simulation, candidate, (1.0,), states, change)


def _change(fidelity: Fidelity, candidate: Candidate) -> Change:
    """The change of the data by an effect at a size."""

    def change(only: str | None, size: float, states: States) -> Array | None:
        return fidelity.column(candidate.name, values_at_size(candidate, size, only), states)

    return change


def _best(
    fidelity: Fidelity,
    candidate: Candidate,
    sizes: Sequence[float],
    states: States,
    change: Change,
) -> Score | None:
    scores = (
        _score(fidelity, candidate, way * size, states, change)[1]
        for way in signs(candidate.sizes)
        for size in sizes
    )
    return max(filter(None, scores), key=lambda one: one.gain, default=None)


def onset_score(
    fidelity: Fidelity, candidate: Candidate, silent: float, largest: float, states: States
) -> Score | None:
    """Score of an effect that has none at a small size; None: nor at larger ones.

    A limit does nothing up to some size, and soon far more than the data hold. Bisection leads to
    the size at whose columns the regression finds that size itself.
    """
    scores = (
        score
        for way in signs(candidate.sizes)
        for score in _bisect(fidelity, candidate, way * silent, way * largest, states)
    )
    return max(scores, key=lambda one: (one.factor > CLOSE, one.gain), default=None)


def _bisect(
    fidelity: Fidelity, candidate: Candidate, low: float, high: float, states: States
) -> Iterator[Score]:
    """Scores on the way to that size; low : a size without a score."""
    size, change = high, _change(fidelity, candidate)
    for _ in range(TRIALS):
        seen, score = _score(fidelity, candidate, size, states, change)
        if score is not None:
            # A size that is a little smaller may not act, and a fit would stay there.
            at, neutral = values_at_size(candidate, size), candidate.neutral
            own = {
                n: at[n] for n in neutral if score.factor < 1.0 and score.values[n] != neutral[n]
            }
            yield replace(score, values={**score.values, **own})
            if CLOSE < score.factor < 1.0 / CLOSE:
                return
        if seen and (score is None or score.factor < 1.0):
            high = size
        elif size == high:  # shows nothing, or is not large enough
            return
        else:
            low = size
        size = float(np.sign(high) * np.sqrt(low * high))


def _columns(
    fidelity: Fidelity, candidate: Candidate, size: float, states: States, change: Change
) -> Iterator[Column | None]:
    """Columns of the size parameters that change the data visibly at this size.

    None: the model cannot be simulated at it
    """
    angle = next((u.name for u in candidate.states if u.angle), None)
    single = len(candidate.sizes) == 1
    for u in candidate.sizes:
        only = None if single else u.name
        found = change(only, size, states)
        if found is None:
            yield None
            continue
        if np.linalg.norm(found) < HIDDEN_NORM:
            continue
        turned = None
        if angle is not None:
            turned = change(only, size, [{**s, angle: pi / 2} for s in states])
        if turned is None or np.allclose(turned, found):
            yield Column(size=u.name, run=None, change=found)
            continue
        for run in range(len(states)):
            for one in (found, turned):
                own = np.where(fidelity.owners == run, one, 0.0)
                yield Column(size=u.name, run=run, change=own)


def _score(
    fidelity: Fidelity, candidate: Candidate, size: float, states: States, change: Change
) -> tuple[bool, Score | None]:
    """Whether the columns show anything, and their gain with one-sided sizes kept on their side.

    None: they show nothing, cannot be simulated, or are all on the other side
    """
    every = list(_columns(fidelity, candidate, size, states, change))
    columns = [one for one in every if one is not None]
    if not columns:
        return bool(every), None
    products = fidelity.data.products(np.stack([c.change for c in columns]).T)
    two_sided = np.array([c.run is not None for c in columns])
    keep = np.arange(len(columns))
    while len(keep):
        value, mean = gain(products.gram[np.ix_(keep, keep)], products.along[keep])
        wrong = (mean < 0.0) & ~two_sided[keep]
        if not wrong.any():
            break
        keep = keep[~wrong]
    else:
        return True, None
    beta = np.zeros(len(columns))
    beta[keep] = mean
    values, own = _estimate(candidate, size, columns, beta, states)
    at, neutral = values_at_size(candidate, size), candidate.neutral
    factor = max(
        abs(values[name] - neutral[name]) / abs(at[name] - neutral[name])
        for name in {c.size for c in columns}
    )
    theta = fidelity.data.theta(products, beta)
    return True, Score(gain=value, factor=factor, values=values, states=own, theta=theta)


def _estimate(
    candidate: Candidate, size: float, columns: Sequence[Column], beta: Array, states: States
) -> tuple[dict[str, float], tuple[dict[str, float], ...]]:
    """Sizes, shapes and states that these coefficients of the columns stand for."""
    values = values_at_size(candidate, 0.0)
    turned = [dict(own) for own in states]
    angle = next((u.name for u in candidate.states if u.angle), "")
    for u in candidate.sizes:
        own = [(c, float(b)) for c, b in zip(columns, beta, strict=True) if c.size == u.name]
        factor = own[0][1] if own else 0.0
        if own and own[0][0].run is not None:
            amplitudes = []
            for run in range(len(turned)):
                cosine, sine = (b for c, b in own if c.run == run)
                amplitudes.append(float(np.hypot(cosine, sine)))
                turned[run][angle] = float(np.arctan2(sine, cosine))
            factor = float(np.mean(amplitudes))
        values[u.name] = _scale_size(candidate, u, factor, values_at_size(candidate, size)[u.name])
    return values, tuple(turned)


def _scale_size(candidate: Candidate, size: Unknown, factor: float, value: float) -> float:
    """A size at a factor of its distance from neutral, within its bounds."""
    neutral = candidate.neutral[size.name]
    return float(np.clip(neutral + factor * (value - neutral), size.lower, size.upper))
