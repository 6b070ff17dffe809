"""The gain of an effect as far as enough samples share it.

A sample that a contact falls on may be off by several times its noise, and an effect that repairs a
few of them gains as much as one that is there. What each sample gains, g_i, tells by how much
chance moves the whole: their sum G has the variance sum g_i^2. An effect that is there gains by
small shares, whose variance is 2 G. The gain that counts is therefore

    2 G |G| / sum g_i^2

twice the square of the statistic of a likelihood ratio test (Q. Vuong, Econometrica 57 (1989) 307).
A large residual is no spread of chance. The samples' gains are those of a noise with heavy tails,
Student's t of four degrees of freedom and variance 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.signals.log import Array

# Degrees of freedom of the noise: so few that a residual of six deviations is no wonder.
DEGREES = 4.0


@dataclass(frozen=True)
class Pair:
    """A fit, and one of the same runs without some of its effects."""

    larger: FitResult
    smaller: FitResult
    runs: tuple[int, ...]


def shared_gain(model: Model, pair: Pair) -> float:
    """The gain of the larger set as far as enough samples share it [nats] (a step)."""
    before, after = (_losses(model, one, pair.runs) for one in (pair.smaller, pair.larger))
    gains = before - after
    total, squares = float(gains.sum()), float(gains @ gains)
    return 2.0 * total * abs(total) / squares if squares else 0.0


def _losses(model: Model, found: FitResult, runs: Sequence[int]) -> Array:
    """Loss of every sample [nats]."""
    parts = [
        model.residual(k, found.effects)({**found.values, **own}).ravel()
        for k, own in zip(runs, found.states, strict=True)
    ]
    squares = np.concatenate(parts) ** 2
    return 0.5 * (DEGREES + 1.0) * np.log1p(squares / (DEGREES - 2.0))
