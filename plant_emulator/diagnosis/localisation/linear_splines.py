"""Hat functions: any smooth function is a sum of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


def hats(value: Array, knots: Array) -> Array:
    """Hat functions: 1 at their knot, 0 at the next ones, constant outside; shape (n, knots)."""
    inside = np.clip(value, knots[0], knots[-1])
    return np.stack([np.interp(inside, knots, row) for row in np.eye(len(knots))], axis=-1)


def of_time(time: Array, step: float, most: int = 12) -> Array:
    """Hat functions of time, about `step` apart [s], or further so that they are not too many."""
    count = max(2, min(most, int(np.ceil((time[-1] - time[0]) / step)) + 1))
    return hats(time, np.linspace(time[0], time[-1], count))
