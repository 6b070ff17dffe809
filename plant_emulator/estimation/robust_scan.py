"""Scan of start values for a fit, with a robust loss that judges them (pure).

Where contact comes and goes, or a frequency is unknown, the sum of squares has many local minima,
and a descent ends in the nearest one.
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
    """Loss of Cauchy's distribution, sum of log(1 + r^2) (P. J. Huber, Robust Statistics).

    residual : r, whitened. A sample far off counts little more than one nearby.
    """
    return float(np.sum(np.log1p(residual**2)))


def combinations(states: Sequence[Unknown]) -> Iterator[tuple[dict[str, float], str | None]]:
    """All combinations of the starts of states, by name, without an angle; and the angle's name."""
    angle = next((u.name for u in states if u.angle), None)
    others = [u for u in states if u.name != angle]
    for values in product(*(u.starts() for u in others)):
        yield {u.name: value for u, value in zip(others, values, strict=True)}, angle


def harmonic_parts(ahead: Array, aside: Array, behind: Array) -> Array:
    """Mean, cosine and sine part of a function of an angle, shape (3, ...).

    ahead, aside, behind : its values at 0, pi/2 and pi
    """
    middle = 0.5 * (ahead + behind)
    return np.stack([middle, ahead - middle, aside - middle])


def harmonic_weights(angles: Array) -> Array:
    """Weights of the mean, cosine and sine part at angles [rad], shape (n, 3)."""
    return np.stack([np.ones_like(angles), np.cos(angles), np.sin(angles)], axis=1)


def scan_unknowns(
    residual: Residual, found: Mapping[str, float], states: Sequence[Unknown]
) -> dict[str, float]:
    """Scan the states that have many local minima, and the angles; return all states by name.

    found : all states at their present values; those that are not scanned stay there

    Cauchy's loss judges the trials, because it bears spikes at the wrong time. Residuals at three
    values of an angle give those at all others.
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
        basis = harmonic_parts(*(residual({**trial, angle: a}) for a in (0.0, pi / 2, pi)))
        for a, weights in zip(ANGLES, harmonic_weights(ANGLES), strict=True):
            turned = np.tensordot(weights, basis, axes=1)
            trials.append((cauchy_loss(turned), {**trial, angle: float(a)}))
    return min(trials, key=lambda one: one[0])[1]
