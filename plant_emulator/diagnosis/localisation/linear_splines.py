"""Linear splines: the basis of hat functions, whose sums approximate any smooth function."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


def linear_splines(value: Array, knots: Array) -> Array:
    """Hat functions at these values: 1 at their knot, 0 at the others, constant outside.

    value : shape (n,); knots : ascending; the result has the shape (n, knots)
    """
    inside = np.clip(value, knots[0], knots[-1])
    return np.stack([np.interp(inside, knots, row) for row in np.eye(len(knots))], axis=-1)


def time_splines(time: Array, step: float, most: int = 12) -> Array:
    """Hat functions of time, with knots about `step` apart [s] and at most `most` of them."""
    count = max(2, min(most, int(np.ceil((time[-1] - time[0]) / step)) + 1))
    return linear_splines(time, np.linspace(time[0], time[-1], count))
