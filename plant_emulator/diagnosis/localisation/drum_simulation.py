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
    whole interval at once, exactly, where the drum floats in the gap throughout. Where a step stays
    on one side of the gap, it is linear in d -+ alpha and v = d': its matrix gives the same step
    without waiting for one stage after the other. One loop without callees, for the compiler's
    cache.
    """
    found = np.zeros(len(time))
    d, w, lead = position * half_gap, 0.0, damping / stiffness
    shortest = 0.5 / max(damping / inertia, np.sqrt(stiffness / inertia))
    for k in range(1, len(time)):
        whole = time[k] - time[k - 1]
        free = 0.0 if parked[k] > 0.0 else 1.0 / inertia
        if parked[k] > 0.0:
            w = 0.0
        v, slope, hardness = gear[k - 1] - w, free * torque[k], free * stiffness
        rate = (gear[k] - gear[k - 1]) / whole - slope
        end = d + whole * v + 0.5 * whole**2 * rate
        ahead = end + lead * (v + whole * rate)
        if abs(d + lead * v) < half_gap and abs(ahead) < half_gap:
            d, w = end, w + whole * slope
            found[k] = w
            continue
        steps = int(np.ceil(whole / shortest))
        h = whole / steps
        # The matrix of such a step, 1 + hA (1 + hA/2 (1 + hA/3 (1 + hA/4))) by Horner's scheme, and
        # the response to the rate, the second column of h (1 + hA/2 (1 + hA/3 (1 + hA/4))).
        dd, dv, vd, vv, dr, vr = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
        for order in range(4, 0, -1):
            dr, vr, part = h * dv, h * vv, h / order
            hard, damped = part * hardness, part * hardness * lead
            dd, vd = 1.0 + part * vd, -hard * dd - damped * vd
            dv, vv = part * vv, 1.0 - hard * dv - damped * vv
        for _ in range(steps):
            dx = dv_dt = moved = gained = 0.0
            low, high = np.inf, -np.inf
            for stage in range(4):
                part = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
                y = d + part * dx + lead * (v + part * dv_dt)
                dx = v + part * dv_dt
                low, high = min(low, y), max(high, y)
                over = y - half_gap if y > half_gap else min(y + half_gap, 0.0)
                dv_dt = rate - hardness * over
                weight = h / 6.0 if stage in (0, 3) else h / 3.0
                moved, gained = moved + weight * dx, gained + weight * dv_dt
            if low > half_gap or high < -half_gap:
                side = half_gap if low > half_gap else -half_gap
                d -= side
                d, v = side + dd * d + dv * v + dr * rate, vd * d + vv * v + vr * rate
            else:
                d, v = d + moved, v + gained
        w = 0.0 if parked[k] > 0.0 else gear[k] - v
        found[k] = w
    return found
