"""The covariance of the parity relations over a run, from the noise of the sensors.

The relations are linear in the noise of omega_m, omega_d, i, T and u at two samples. Their
covariance over the run is therefore banded, and its Cholesky factor whitens them. A jump within an
interval adds what the mean of its ends leaves open. At standstill friction takes any value up to
its level.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.measured_signals import (
    STILL_SPEED,
    VOID_VARIANCE,
    MeasuredSignals,
    jump_variance,
)
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
    WhitenedRelations,
    relation_count,
    relation_residuals,
)
from plant_emulator.model.array_laws import flux

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

# Standard deviation of the torque of the truck's brake at standstill [N m].
BRAKE_TORQUE = 300.0
# A simulated drive reaches and leaves a limit so long before or after the real one [s].
LIMIT_TIME = 0.1


def whitened_relations(
    m: MeasuredSignals,
    p: Mapping[str, float],
    simulated: tuple[Array, NDArray[np.bool_]] | None = None,
) -> WhitenedRelations:
    """Compute the relations of a run and the factor of their covariance; p : parameter values [SI].

    simulated : residuals of the relations in a simulated run with the same samples, and whether its
        drive is limited. The residuals are the relations' own error between samples: they are taken
        off, with a standard deviation of half their value. A limit that both runs reach lasts from
        the earlier start to the later end.
    """
    value, limited = relation_residuals(m, p)
    if simulated is None:
        variance = extra_variance(m, p, limited)
    else:
        left, also = simulated
        limited = limited | (also & near_limit(limited, m))
        value = value - left
        variance = extra_variance(m, p, limited) + (0.5 * left) ** 2
    if m.unknown_torque:
        variance[GEAR] += VOID_VARIANCE
    if m.missing_current:
        variance[[MOTOR, *range(DRIVE, relation_count(m))]] += VOID_VARIANCE
    return WhitenedRelations(value, covariance_factor(m, p, variance))


def near_limit(limited: NDArray[np.bool_], m: MeasuredSignals) -> NDArray[np.bool_]:
    """Whether each interval lies within LIMIT_TIME of one in which the drive is limited."""
    from scipy.ndimage import maximum_filter1d

    reach = int(np.ceil(LIMIT_TIME / float(np.median(m.intervals))))
    return np.asarray(maximum_filter1d(limited, 2 * reach + 1, mode="constant"))


def extra_variance(m: MeasuredSignals, p: Mapping[str, float], limited: NDArray[np.bool_]) -> Array:
    """Variance of each relation beyond the sensors' noise, shape (3 or 4, n - 1)."""
    k = flux(m.speed, p)[1:]
    variance = np.zeros((relation_count(m), len(m.intervals)))
    variance[MOTOR] = jump_variance(m.torque, m.noise[3]) + k**2 * jump_variance(
        m.current, m.noise[2]
    )
    level = 3.0 * p["gear_coulomb_friction"] / p["gear_ratio"]
    still = np.minimum(np.abs(m.speed[1:]), np.abs(m.speed[:-1])) < STILL_SPEED
    still |= np.sign(m.speed[1:]) != np.sign(m.speed[:-1])
    variance[GEAR] = jump_variance(m.torque, m.noise[3])
    variance[GEAR] += np.where(still, level**2 + m.truck * BRAKE_TORQUE**2, 0.0)
    variance[DRIVE] = np.where(limited, VOID_VARIANCE, 0.0)
    if m.voltage is not None:
        # Where the current jumps, the voltage that makes it do so falls between the samples.
        surge = 12.0 * (p["armature_inductance"] / m.intervals) ** 2
        variance[ARMATURE] = jump_variance(m.voltage, m.noise[4])
        variance[ARMATURE] += (p["armature_resistance"] ** 2 + surge) * jump_variance(
            m.current, m.noise[2]
        )
    return variance


def noise_sensitivities(m: MeasuredSignals, p: Mapping[str, float]) -> tuple[Array, Array]:
    """Derivatives of the relations by each sensor's unit noise at begin and end of an interval.

    Both have the shape (3 or 4, 5, n - 1).
    """
    xi, step, n = p["gear_ratio"], m.intervals, len(m.intervals)
    k, zero, half = flux(m.speed, p), np.zeros(n), np.full(n, 0.5)

    def at(sign: float, slope: Array) -> Array:
        motor = [sign * p["motor_inertia"] / step, zero, -0.5 * slope, -half, zero]
        inertia = sign * p["gear_inertia"] / step / xi**2
        gear = [inertia, sign * p["drum_inertia"] / step / xi, zero, half, zero]
        speed_error = half / p["speed_gain"]
        voltage = zero if m.voltage is None else speed_error / p["current_gain"]
        drive = [half, zero, speed_error, zero, voltage]
        current = -0.5 * p["armature_resistance"] - sign * p["armature_inductance"] / step
        armature = [-0.5 * slope, zero, current, zero, half]
        return (
            np.array([motor, gear, drive, armature])[: relation_count(m)] * m.noise[None, :, None]
        )

    return at(-1.0, k[:-1]), at(1.0, k[1:])


def covariance_factor(m: MeasuredSignals, p: Mapping[str, float], variance: Array) -> Array:
    """Lower banded Cholesky factor of the covariance, the relations of an interval side by side.

    variance : beyond the sensors' noise, shape (3 or 4, n - 1)
    """
    from scipy.linalg import cholesky_banded

    begin, end = noise_sensitivities(m, p)
    n, rows = len(m.intervals), relation_count(m)
    banded = np.zeros((2 * rows, rows * n))
    for r in range(rows):
        for c in range(rows):
            if r >= c:
                banded[r - c, c::rows] = (begin[r] * begin[c] + end[r] * end[c]).sum(0)
            shared = (begin[r][:, 1:] * end[c][:, :-1]).sum(0)
            banded[rows + r - c, c::rows][: n - 1] = shared
        banded[0, r::rows] += variance[r]
    return np.asarray(cholesky_banded(banded, lower=True))
