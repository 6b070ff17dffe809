"""The two compiled loops over samples: the truck's travel and a Kalman filter (pure).

Each loop is one function that calls no other, because numba's disk cache tracks one file only.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.solver import compiler

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array


@cache
def compile_loop(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiled form of a loop; numba compiles it at its first call."""
    compiler.use_cache([__file__, str(compiler.__file__)], ["road"])
    return compiler.compile_function(function, on_disk=True)


def travel(
    torque: Array,
    held: NDArray[np.bool_],
    period: float,
    driving: float,
    braking: float,
    rolling: float,
    viscous: float,
    start: float,
) -> Array:
    """Velocity [m/s] under the true motor torque [N m], shape (n,).

    held : where the truck is known to stand, shape (n,); period : of the samples [s]
    driving, braking : acceleration per torque [m/s^2 / (N m)]
    rolling : deceleration [m/s^2]; viscous : deceleration per velocity [1/s]
    start : velocity at the first sample [m/s]
    If the truck comes to rest within a period, the remaining time of the period starts from rest.
    """
    found = np.zeros(len(torque))
    found[0] = start
    for k in range(1, len(torque)):
        if held[k]:
            continue
        before, time = found[k - 1], period
        mean = 0.5 * (torque[k - 1] + torque[k])
        if before != 0.0:
            sign = 1.0 if before > 0.0 else -1.0
            per_torque = driving if mean * sign > 0.0 else braking
            rate = per_torque * mean - sign * (rolling + viscous * abs(before))
            after = before + period * rate
            if after * sign > 0.0:
                found[k] = after
                continue
            time = after / rate
        surplus = driving * abs(mean) - rolling
        if surplus > 0.0:
            found[k] = surplus * time if mean > 0.0 else -surplus * time
    return found


def predict_walk(residuals: Array, gain: Array, stands: NDArray[np.bool_]) -> Array:
    """Random walk of each column, predicted from the rows before, shape (m, columns).

    walk <- walk + gain (residual - walk), 0 where the truck stands

    gain : Kalman gain, shape (m,); stands : where the truck stands, shape (m,)
    """
    walk = np.zeros(residuals.shape)
    for k in range(1, len(residuals)):
        if not stands[k]:
            for column in range(residuals.shape[1]):
                before = walk[k - 1, column]
                walk[k, column] = before + gain[k - 1] * (residuals[k - 1, column] - before)
    return walk
