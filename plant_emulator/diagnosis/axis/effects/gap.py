"""The load behind a gap: when it flies free, and with which change of its speed it is caught.

The motor pushes the load by one flank. Where the motor slows down more than the load does by its
own friction, the load leaves the flank. It flies, slowed by its friction, until a flank catches it.
Two bodies that meet go on together (plastic impact).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.diagnosis.axis.motion.run import Motion
    from plant_emulator.signals.log import Array

# Nodes of a flight that are looked at first; each further look is over twice as many.
LOOK = 64


def crossed(motion: Motion, half: float, slowed: float) -> tuple[NDArray[np.bool_], Array]:
    """Whether the load is free, and its acceleration by impacts, shape (nodes,) each.

    half : of the gap [m or rad]; slowed : deceleration of the free load by its friction
    """
    q, v, t = motion.position, motion.velocity, motion.time
    free, hit = np.zeros(len(t), np.bool_), np.zeros(len(t))
    weights = _weights(t)
    driving = motion.acceleration + slowed * np.sign(v)
    leaving = {side: np.flatnonzero(side * driving < 0.0) for side in (1.0, -1.0)}
    k, side = 0, 1.0 if driving[0] >= 0.0 else -1.0
    while True:
        after = leaving[side]
        place = int(np.searchsorted(after, k))
        if place == len(after):
            return free, hit
        k = int(after[place])
        start = float(q[k]) - side * half
        caught, speed, flank = _flight(t[k:], q[k:], start, float(v[k]), half, slowed)
        free[k : k + caught] = True
        if not flank:
            return free, hit
        k, side = k + caught, flank
        # An impulse, spread over the time for which its node counts.
        hit[k] = (v[k] - speed) / weights[k]


def _flight(
    time: Array, motor: Array, start: float, speed: float, half: float, slowed: float
) -> tuple[int, float, float]:
    """Nodes until the load is caught, its speed then, and the flank that catches it; 0: none.

    start, speed : of the load at the first node
    """
    way, stop = np.sign(speed), abs(speed) / slowed if slowed > 0.0 else np.inf
    first, look = 1, LOOK
    while first < len(time):
        part = slice(first, first + look)
        flown = np.minimum(time[part] - time[0], stop)
        load = start + speed * flown - 0.5 * way * slowed * flown**2
        offset = motor[part] - load
        found = np.flatnonzero(np.abs(offset) >= half)
        if len(found):
            k = int(found[0])
            left = speed - way * slowed * float(flown[k])
            return first + k, left, float(np.sign(offset[k]))
        first, look = first + look, 2 * look
    return len(time), 0.0, 0.0


def _weights(nodes: Array) -> Array:
    """Time for which a node counts in an average by Simpson's rule [s]."""
    width = np.diff(nodes, prepend=nodes[0]) + np.diff(nodes, append=nodes[-1])
    return np.asarray(width * np.where(np.arange(len(nodes)) % 2, 2.0, 1.0) / 3.0)
