"""An axis of which everything is known: its motion in closed form, its force by hand."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from plant_emulator.signals.axis_log import AxisLog

Array = NDArray[np.float64]

MASS, VISCOUS, COULOMB, OFFSET = 80.0, 150.0, 25.0, -4.0
PERIOD, LENGTH = 1e-3, 10.0
# Standard deviation of the force's noise [N]; smooth noise would be signal.
NOISE = 2.0


def motion(phase: float = 0.0) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of a travel with several speeds and reversals."""
    t = np.arange(0.0, LENGTH, PERIOD)
    parts = [(0.08, 0.31, 0.0), (0.015, 1.7, phase), (0.0015, 6.1, 1.0)]
    q = sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in parts)
    v = sum(a * 2.0 * np.pi * f * np.cos(2.0 * np.pi * f * t + p) for a, f, p in parts)
    c = sum(-a * (2.0 * np.pi * f) ** 2 * np.sin(2.0 * np.pi * f * t + p) for a, f, p in parts)
    return t, np.asarray(q), np.asarray(v), np.asarray(c)


def log(
    extra: Callable[[Array, Array, Array], Array] | None = None,
    *,
    phase: float = 0.0,
    seed: int = 1,
    force_late: float = 0.0,
) -> AxisLog:
    """A run; extra : force beyond the nominal, of position, velocity and acceleration.

    force_late : the force of the log acts that much later than it is written [s]
    """
    t, q, v, a = motion(phase)
    force = MASS * a + VISCOUS * v + COULOMB * np.sign(v) + OFFSET
    if extra is not None:
        force = force + extra(q, v, a)
    force = np.interp(t + force_late, t, force)
    random = np.random.default_rng(seed)
    return AxisLog(
        time=t,
        position=q + 1e-8 * random.standard_normal(len(q)),
        force=force + NOISE * random.standard_normal(len(q)),
        rotary=False,
        source=f"axis {seed}",
    )
