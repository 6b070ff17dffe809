"""Starts of a fit that are tried before a slope is followed, and the loss that judges them (pure).

Where contact comes and goes, or a frequency is unknown, the squares have many valleys, and a slope
leads only to the next.
"""

from __future__ import annotations

from itertools import product
from math import pi
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.signals.log import Array

# Angles that are tried [rad].
ANGLES = np.linspace(-pi, pi, 24, endpoint=False)


def cauchy_loss(residual: Array) -> float:
    """Sum of log(1 + r^2) of a whitened residual: what lies far off counts, but little more than
    near; the loss of Cauchy's distribution (P. J. Huber, Robust Statistics).
    """
    return float(np.sum(np.log1p(residual**2)))


def combinations(states: Sequence[Unknown]) -> Iterator[tuple[dict[str, float], str | None]]:
    """Starts of all states of a run together by name, but for an angle among them, and its name."""
    angle = next((u.name for u in states if u.angle), None)
    others = [u for u in states if u.name != angle]
    for values in product(*(u.starts() for u in others)):
        yield {u.name: value for u, value in zip(others, values, strict=True)}, angle


def turning(ahead: Array, aside: Array, behind: Array) -> Array:
    """Mean, cosine and sine of what turns with an angle, from its values at 0, pi/2 and pi; shape
    (3, ...).
    """
    middle = 0.5 * (ahead + behind)
    return np.stack([middle, ahead - middle, aside - middle])


def turns(angles: Array) -> Array:
    """Weights of mean, cosine and sine at angles [rad], shape (n, 3)."""
    return np.stack([np.ones_like(angles), np.cos(angles), np.sin(angles)], axis=1)


def scan_unknowns(
    residual: Residual, found: Mapping[str, float], states: Sequence[Unknown]
) -> dict[str, float]:
    """States of a run where what has many valleys and angles starts in the best, all else as found.

    With Cauchy's loss, which forgives spikes at the wrong time; three values of an angle tell
    the others.
    """
    narrow = [u for u in states if u.step is not None or u.angle]
    if not narrow:
        return dict(found)
    trials: list[tuple[float, dict[str, float]]] = []
    for state, angle in combinations(narrow):
        trial = {**found, **state}
        if angle is None:
            trials.append((cauchy_loss(residual(trial)), trial))
            continue
        basis = turning(*(residual({**trial, angle: a}) for a in (0.0, pi / 2, pi)))
        for a, weights in zip(ANGLES, turns(ANGLES), strict=True):
            turned = np.tensordot(weights, basis, axes=1)
            trials.append((cauchy_loss(turned), {**trial, angle: float(a)}))
    return min(trials, key=lambda one: one[0])[1]
