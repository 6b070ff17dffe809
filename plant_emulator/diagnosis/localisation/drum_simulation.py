"""The drum behind its backlash shaft, driven by a gear whose speed is known.

Thesis, eq. 3.29 to 3.31 and 3.34, without the rest of the bench: ten to thirty times faster.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.solver import compiler

if TYPE_CHECKING:
    from collections.abc import Callable

    from plant_emulator.signals.log import Array


@cache
def compile_once(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop, once in this process."""
    compiler.use_cache([__file__, str(compiler.__file__)], ["driven drum"])
    return compiler.compile_function(function, on_disk=True)


def drum_speed(
    time: Array,
    gear: Array,
    torque: Array,
    parked: Array,
    position: float,
    half_gap: float,
    stiffness: float,
    damping: float,
    inertia: float,
) -> Array:
    """Speed of the drum [rad/s] that starts at rest, shape (n,).

    J_d omega_d' = k_gd D_alpha(d + c/k_gd d') + T_d,   d' = omega_g - omega_d

    gear : speed of the gear's output [rad/s], linear between samples
    torque, parked : on the drum [N m], 0 or 1, over the interval that ends at a sample
    position : d / alpha at the start, -1 to 1

    Runge-Kutta steps of half the shortest time constant leave a hundredth of the sensor's noise. A
    whole interval at once, exactly, where the drum floats in the gap throughout. One loop without
    callees, for the compiler's cache.
    """
    found = np.zeros(len(time))
    d, w, lead = position * half_gap, 0.0, damping / stiffness
    shortest = 0.5 / max(damping / inertia, np.sqrt(stiffness / inertia))
    for k in range(1, len(time)):
        whole = time[k] - time[k - 1]
        rate, u = (gear[k] - gear[k - 1]) / whole, gear[k - 1]
        free = 0.0 if parked[k] > 0.0 else 1.0 / inertia
        if parked[k] > 0.0:
            w = 0.0
        slope = free * torque[k]
        end = d + whole * (u - w) + 0.5 * whole**2 * (rate - slope)
        ahead = end + lead * (u - w + whole * (rate - slope))
        if abs(d + lead * (u - w)) < half_gap and abs(ahead) < half_gap:
            d, w = end, w + whole * slope
            found[k] = w
            continue
        steps = int(np.ceil(whole / shortest))
        h = whole / steps
        for _ in range(steps):
            dx = dv = moved = gained = 0.0
            for stage in range(4):
                part = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
                y = d + part * dx
                dx = u + rate * part - (w + part * dv)
                y += lead * dx
                over = y - half_gap if y > half_gap else min(y + half_gap, 0.0)
                dv = free * (stiffness * over + torque[k])
                weight = h / 6.0 if stage in (0, 3) else h / 3.0
                moved, gained = moved + weight * dx, gained + weight * dv
            d, w, u = d + moved, w + gained, u + rate * h
        found[k] = w
    return found
