"""The covariance of the relations over a run, from the noise of the sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
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

    from plant_emulator.signals.log import Array

# Standard deviation of the torque of the truck's brake, which reacts at standstill [N m].
BRAKE = 300.0
# A simulated drive reaches and leaves a limit that much before or after the real one [s].
SAME_LIMIT = 0.1


def relations(
    m: Measured,
    p: Mapping[str, float],
    simulated: tuple[Array, NDArray[np.bool_]] | None = None,
) -> Relations:
    """The relations of a run.

    simulated : what a simulated run with the same samples leaves of them, taken off and not
        believed better than by half, and where its drive is limited. A limit that both runs reach
        begins and ends with the earlier and the later one
    """
    value, limited = values(m, p)
    if simulated is None:
        variance = extra_variance(m, p, limited)
    else:
        left, also = simulated
        limited = limited | (also & near(limited, m))
        value = value - left
        variance = extra_variance(m, p, limited) + (0.5 * left) ** 2
    if m.missing_current:
        variance[[MOTOR, *range(DRIVE, m.rows)]] += VOID
    return Relations(value, factor(m, p, variance))


def near(limited: NDArray[np.bool_], m: Measured) -> NDArray[np.bool_]:
    """Which intervals lie no further than SAME_LIMIT from one in which the drive is limited."""
    from scipy.ndimage import maximum_filter1d

    reach = int(np.ceil(SAME_LIMIT / float(np.median(m.intervals))))
    return np.asarray(maximum_filter1d(limited, 2 * reach + 1, mode="constant"))


def extra_variance(m: Measured, p: Mapping[str, float], limited: NDArray[np.bool_]) -> Array:
    """Variance of each relation beside the sensors' noise, shape (m.rows, n - 1)."""
    k = flux(m.speed, p)[1:]
    variance = np.zeros((m.rows, len(m.intervals)))
    variance[MOTOR] = jump(m.torque, m.noise[3]) + k**2 * jump(m.current, m.noise[2])
    level = 3.0 * p["gear_coulomb_friction"] / p["gear_ratio"]
    still = np.minimum(np.abs(m.speed[1:]), np.abs(m.speed[:-1])) < STILL
    still |= np.sign(m.speed[1:]) != np.sign(m.speed[:-1])
    variance[GEAR] = jump(m.torque, m.noise[3])
    variance[GEAR] += np.where(still, level**2 + m.truck * BRAKE**2, 0.0)
    variance[DRIVE] = np.where(limited, VOID, 0.0)
    if m.voltage is not None:
        # Where the current jumps, the voltage that makes it do so falls between the samples.
        surge = 12.0 * (p["armature_inductance"] / m.intervals) ** 2
        variance[ARMATURE] = jump(m.voltage, m.noise[4])
        variance[ARMATURE] += (p["armature_resistance"] ** 2 + surge) * jump(m.current, m.noise[2])
    return variance


def sensitivities(m: Measured, p: Mapping[str, float]) -> tuple[Array, Array]:
    """Relations by noise of unit variance at begin and end, shape (m.rows, 5, n - 1) each."""
    xi, step, n = p["gear_ratio"], m.intervals, len(m.intervals)
    k, zero, half = flux(m.speed, p), np.zeros(n), np.full(n, 0.5)

    def at(sign: float, slope: Array) -> Array:
        motor = [sign * p["motor_inertia"] / step, zero, -0.5 * slope, -half, zero]
        inertia = sign * p["gear_inertia"] / step / xi**2
        gear = [inertia, sign * p["drum_inertia"] / step / xi, zero, half, zero]
        told = half / p["speed_gain"]
        voltage = zero if m.voltage is None else told / p["current_gain"]
        drive = [half, zero, told, zero, voltage]
        current = -0.5 * p["armature_resistance"] - sign * p["armature_inductance"] / step
        armature = [-0.5 * slope, zero, current, zero, half]
        return np.array([motor, gear, drive, armature])[: m.rows] * m.noise[None, :, None]

    return at(-1.0, k[:-1]), at(1.0, k[1:])


def factor(m: Measured, p: Mapping[str, float], variance: Array) -> Array:
    """Lower banded Cholesky factor of the covariance, relations of an interval side by side."""
    from scipy.linalg import cholesky_banded

    begin, end = sensitivities(m, p)
    n, rows = len(m.intervals), m.rows
    banded = np.zeros((2 * rows, rows * n))
    for r in range(rows):
        for c in range(rows):
            if r >= c:
                banded[r - c, c::rows] = (begin[r] * begin[c] + end[r] * end[c]).sum(0)
            shared = (begin[r][:, 1:] * end[c][:, :-1]).sum(0)
            banded[rows + r - c, c::rows][: n - 1] = shared
        banded[0, r::rows] += variance[r]
    return np.asarray(cholesky_banded(banded, lower=True))
