"""Error of the emulated road: agreement of speeds, force in cruise, energy.

A driver holds his speed even against a wrong road load, so that the speed alone does not show it.
Force and energy do.

    Val1 = 100 (1 - sqrt(mean e^2) / (max y - min y)),  Val2 = 100 (1 - sum |e| / sum |y|)

Here y is the speed on the road and e = road minus bench (thesis, eq. 3.37-3.41). Eq. 3.40 is taken
as a ratio of sums, because sample by sample it divides by zero at standstill.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gateway.arrays import Array
from gateway.errors import GatewayError

# Cruise: the speed changes by less than STEADY_SLOPE [m/s^2] for at least SHORTEST_CRUISE [s].
STEADY_SLOPE = 0.02
SHORTEST_CRUISE = 5.0
# [s] Span of the slope of the speed; one digit of the drum speed is 0.3 mm/s at the rim.
SLOPE_SPAN = 0.5
# [m/s] Speed above which the truck cruises.
CRUISE_SPEED = 0.5


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Val1 and Val2 of two signals [%]."""

    val1: float
    val2: float


def agreement(wanted: Array, found: Array) -> Agreement:
    """Val1 and Val2 [%] of `found` against `wanted`, shape (n,) each.

    Raises GatewayError where `wanted` does not move.
    """
    span, total = float(np.ptp(wanted)), float(np.abs(wanted).sum())
    if span == 0.0 or total == 0.0:
        raise GatewayError("the wanted signal does not move: there is nothing to compare with")
    error = wanted - found
    return Agreement(
        val1=100.0 * (1.0 - float(np.sqrt(np.mean(error**2))) / span),
        val2=100.0 * (1.0 - float(np.abs(error).sum()) / total),
    )


def cruise(time: Array, speed: Array) -> slice | None:
    """Samples of the longest steady travel; None without one of 5 s.

    time [s], speed [m/s], shape (n,) each
    """
    half = max(1, round(SLOPE_SPAN / 2.0 / float(np.median(np.diff(time)))))
    slope = np.zeros_like(speed)
    slope[half:-half] = (speed[2 * half :] - speed[: -2 * half]) / (
        time[2 * half :] - time[: -2 * half]
    )
    steady = (np.abs(slope) < STEADY_SLOPE) & (speed > CRUISE_SPEED)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], steady.astype(np.int8), [0]))))
    starts, ends = edges[::2], edges[1::2] - 1
    if not len(starts):
        return None
    longest = int(np.argmax(time[ends] - time[starts]))
    first, last = int(starts[longest]), int(ends[longest])
    if time[last] - time[first] < SHORTEST_CRUISE:
        return None
    return slice(first, last + 1)


def traction_energy(time: Array, force: Array, speed: Array) -> float:
    """Energy that drives the truck [J]: integral of the positive part of force times speed.

    time [s], force [N], speed [m/s], shape (n,) each; a force acts up to its sample
    """
    power = np.maximum(force[1:] * 0.5 * (speed[1:] + speed[:-1]), 0.0)
    return float(np.sum(power * np.diff(time)))


def road_speed(
    time: Array, force: Array, mass: float, resistance: Callable[[float], float]
) -> Array:
    """Speed that a truck would have on its road under a logged force, from rest [m/s], shape (n,).

    force : at the wheel, acting up to its sample [N], shape (n,)
    mass : of the truck [kg]; resistance : of the road at a speed [N]

    A negative force on the standing truck is the reaction of its brake, which moves nothing.
    """
    speed = np.zeros_like(time)
    for k in range(1, len(time)):
        before, period = float(speed[k - 1]), float(time[k] - time[k - 1])
        against = resistance(max(before, np.nextafter(0.0, 1.0)))
        speed[k] = max(0.0, before + period * (float(force[k]) - against) / mass)
    return speed
