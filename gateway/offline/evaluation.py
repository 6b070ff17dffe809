"""Key figures of a run: how closely the drum feels like the road.

Velocity alone cannot see a wrong road load once the truck has a driver who holds his speed, so
force and energy stand beside it.

    Val1 = 100 (1 - sqrt(mean e^2) / (max y - min y)),  Val2 = 100 (1 - sum |e| / sum |y|)

with y the road's speed and e = road minus bench (thesis, eq. 3.37-3.41; eq. 3.40 read as a ratio of
sums, since sample by sample it divides by zero at standstill).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gateway.arrays import Array
from gateway.errors import GatewayError

# Cruise: the speed changes by less than this [m/s^2], for at least so long [s].
STEADY = 0.02
SHORTEST_CRUISE = 5.0
# Speed is differentiated over this span [s]: one digit of the drum speed is 0.3 mm/s at the rim.
SLOPE_SPAN = 0.5
MOVING = 0.5


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Val1 and Val2 of two signals [%]."""

    val1: float
    val2: float


def agreement(wanted: Array, found: Array) -> Agreement:
    """Val1 and Val2 of `found` against `wanted`, shape (n,) each; refuses a signal at rest."""
    span, total = float(np.ptp(wanted)), float(np.abs(wanted).sum())
    if span == 0.0 or total == 0.0:
        raise GatewayError("the wanted signal does not move: there is nothing to compare with")
    error = wanted - found
    return Agreement(
        val1=100.0 * (1.0 - float(np.sqrt(np.mean(error**2))) / span),
        val2=100.0 * (1.0 - float(np.abs(error).sum()) / total),
    )


def cruise(time: Array, speed: Array) -> slice | None:
    """The longest stretch of steady travel [samples]; None when there is none of 5 s."""
    half = max(1, round(SLOPE_SPAN / 2.0 / float(np.median(np.diff(time)))))
    slope = np.zeros_like(speed)
    slope[half:-half] = (speed[2 * half :] - speed[: -2 * half]) / (
        time[2 * half :] - time[: -2 * half]
    )
    steady = (np.abs(slope) < STEADY) & (speed > MOVING)
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
    """Integral of the positive part of force times speed [J]; force acts up to its sample."""
    power = np.maximum(force[1:] * 0.5 * (speed[1:] + speed[:-1]), 0.0)
    return float(np.sum(power * np.diff(time)))


def road_speed(
    time: Array, force: Array, mass: float, resistance: Callable[[float], float]
) -> Array:
    """Speed [m/s] that a truck would have on its road under a logged force, from rest.

    force : at the wheel, acting up to its sample [N]; resistance : of the road at a speed [N]. A
    negative force on the standing truck is its brake's reaction and does not push it back.
    """
    speed = np.zeros_like(time)
    for k in range(1, len(time)):
        before, period = float(speed[k - 1]), float(time[k] - time[k - 1])
        against = resistance(max(before, np.nextafter(0.0, 1.0)))
        speed[k] = max(0.0, before + period * (float(force[k]) - against) / mass)
    return speed
