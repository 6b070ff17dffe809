"""The covariance of the relations over a run, from the noise of the sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.relations import (
    DRIVE,
    GEAR,
    MOTOR,
    ROWS,
    STILL,
    VOID,
    Measured,
    Relations,
    flux,
    jump,
    values,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from plant_emulator.estimation import Array

# Standard deviation of the torque of the truck's brake, which reacts at standstill [N m].
BRAKE = 300.0


def relations(
    m: Measured, p: Mapping[str, float], discretisation: Array | None = None
) -> Relations:
    """The relations of a run.

    discretisation : what a simulated run with the same samples leaves of them: taken off, and not
        believed better than by half
    """
    value, limited = values(m, p)
    variance = extra_variance(m, p, limited)
    if discretisation is not None:
        value = value - discretisation
        variance += (0.5 * discretisation) ** 2
    if m.missing_current:
        variance[[MOTOR, DRIVE]] += VOID
    return Relations(value, factor(m, p, variance))


def extra_variance(m: Measured, p: Mapping[str, float], limited: NDArray[np.bool_]) -> Array:
    """Variance of each relation beside the sensors' noise, shape (3, n - 1)."""
    k = flux(m.speed, p)[1:]
    variance = np.zeros((ROWS, len(m.intervals)))
    variance[MOTOR] = jump(m.torque, m.noise[3]) + k**2 * jump(m.current, m.noise[2])
    level = 3.0 * p["gear_coulomb_friction"] / p["gear_ratio"]
    still = np.minimum(np.abs(m.speed[1:]), np.abs(m.speed[:-1])) < STILL
    still |= np.sign(m.speed[1:]) != np.sign(m.speed[:-1])
    variance[GEAR] = jump(m.torque, m.noise[3])
    variance[GEAR] += np.where(still, level**2 + m.truck * BRAKE**2, 0.0)
    variance[DRIVE] = np.where(limited, VOID, 0.0)
    return variance


def sensitivities(m: Measured, p: Mapping[str, float]) -> tuple[Array, Array]:
    """Relations by noise of unit variance at begin and end, shape (3, 4, n - 1) each."""
    xi, step, n = p["gear_ratio"], m.intervals, len(m.intervals)
    k, zero, half = flux(m.speed, p), np.zeros(n), np.full(n, 0.5)

    def at(sign: float, slope: Array) -> Array:
        motor = [sign * p["motor_inertia"] / step, zero, -0.5 * slope, -half]
        inertia = sign * p["gear_inertia"] / step / xi**2
        gear = [inertia, sign * p["drum_inertia"] / step / xi, zero, half]
        drive = [half, zero, half / p["speed_gain"], zero]
        return np.array([motor, gear, drive]) * m.noise[None, :, None]

    return at(-1.0, k[:-1]), at(1.0, k[1:])


def factor(m: Measured, p: Mapping[str, float], variance: Array) -> Array:
    """Lower banded Cholesky factor of the covariance, relations of an interval side by side."""
    from scipy.linalg import cholesky_banded

    begin, end = sensitivities(m, p)
    n = len(m.intervals)
    banded = np.zeros((2 * ROWS, ROWS * n))
    for r in range(ROWS):
        for c in range(ROWS):
            if r >= c:
                banded[r - c, c::ROWS] = (begin[r] * begin[c] + end[r] * end[c]).sum(0)
            shared = (begin[r][:, 1:] * end[c][:, :-1]).sum(0)
            banded[ROWS + r - c, c::ROWS][: n - 1] = shared
        banded[0, r::ROWS] += variance[r]
    return np.asarray(cholesky_banded(banded, lower=True))
