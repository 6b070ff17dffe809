"""Axes with a hidden effect, integrated by a plain Runge-Kutta rule; nothing of ours is used.

A controller of 1 kHz moves the axis through a sum of sines, with an encoder that counts. A smaller
force of higher frequencies is added, as for an identification. The effects have laws of their own:
two masses with a spring or a gap, a bristle of its own state, a saturation as tanh.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 1e-4
"""Of the integration [s]."""
CONTROL = 10
"""Steps that a command is held."""


class Axis(NamedTuple):
    """Constants of an axis; what is 0 is not there.

    inertia .. offset : M, F_v, F_c, and the speed over which the Coulomb friction turns
    share : of the inertia that hangs on the spring (stiffness, damping) behind the gap
    behind : share of the Coulomb friction there
    """

    inertia: float
    viscous: float
    coulomb: float
    width: float
    offset: float
    middle: float
    travel: float
    speed: float
    viscous_asymmetry: float = 0.0
    coulomb_asymmetry: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 1.0
    concave: float = 0.0
    drag: float = 0.0
    bristle: float = 0.0
    load_ratio: float = 0.0
    warm_up: float = 0.0
    warm_up_time: float = 1.0
    gravity: float = 0.0
    ripple: float = 0.0
    slope: float = 0.0
    slope_friction: float = 0.0
    share: float = 0.0
    behind: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    gap: float = 0.0
    saturation: float = 0.0
    delay: float = 0.0
    lag: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What moves the axis: sums of sines.

    sizes, rates, phases : of the reference motion [m or rad, rad/s, rad]
    dither, tones, turns : of the added force [N or N m, rad/s, rad]
    load, load_rate : of an external load [N or N m, rad/s]
    count : of the encoder [m or rad]
    """

    sizes: Array
    rates: Array
    phases: Array
    dither: Array
    tones: Array
    turns: Array
    load: float
    load_rate: float
    count: float


@numba.njit
def _rates(x: Array, force: float, load: float, time: float, a: Axis) -> Array:
    """Rates of motor position and speed, load position and speed, bristle, lagging force."""
    found = np.zeros(6)
    q, v = x[0], x[1]
    acting = x[5] if a.lag > 0.0 else force
    if a.lag > 0.0:
        found[5] = (force - x[5]) / a.lag
    if a.saturation > 0.0:
        acting = a.saturation * np.tanh(acting / a.saturation)
    direction = np.tanh(v / a.width)
    if a.bristle > 0.0:
        found[4] = v / a.bristle * (1.0 - x[4] * np.sign(v))
    held = x[4] if a.bristle > 0.0 else direction
    ratio = abs(v) / a.speed
    place = (q - a.middle) / a.travel
    friction = a.viscous * v + a.coulomb * held * (1.0 - a.behind)
    friction += a.viscous_asymmetry * abs(v) + a.coulomb_asymmetry * abs(direction)
    friction += a.stribeck * np.exp(-abs(v) / a.stribeck_speed) * direction
    friction += a.concave * ratio**0.6 * direction + a.drag * ratio**2 * direction
    friction += a.load_ratio * abs(load) * direction + a.slope_friction * place * direction
    friction *= 1.0 + a.warm_up * np.exp(-time / a.warm_up_time)
    static = a.offset + a.gravity * np.cos(q + 0.4) + a.ripple * np.cos(2.0 * q + 0.7)
    net = acting - load - friction - static - a.slope * place
    found[0] = v
    if a.share == 0.0:
        found[1] = net / a.inertia
        return found
    twist = x[0] - x[2]
    over = max(0.0, abs(twist) - 0.5 * a.gap) * np.sign(twist)
    shaft = 0.0
    if over != 0.0:
        shaft = a.stiffness * over + a.damping * (v - x[3])
    found[1] = (net - shaft) / (a.inertia * (1.0 - a.share))
    found[2] = x[3]
    rest = a.coulomb * a.behind * np.tanh(x[3] / a.width)
    found[3] = (shaft - rest) / (a.inertia * a.share)
    return found


@numba.njit
def _integrated(
    reference: Array, slope: Array, curve: Array, dither: Array, load: Array, count: float, a: Axis
) -> tuple[Array, Array]:
    """Positions and commands at every step, shape (n,) each, with a loop of 8 rad/s."""
    steps = len(reference)
    position, command = np.empty(steps), np.empty(steps)
    late = round(a.delay / STEP)
    x = np.zeros(6)
    x[0] = x[2] = reference[0]
    x[1] = x[3] = slope[0]
    x[4] = np.sign(slope[0])
    before, speed, given = x[0], slope[0], 0.0
    for k in range(steps):
        if k % CONTROL == 0:
            seen = count * np.round(x[0] / count)
            speed += 0.2 * ((seen - before) / (CONTROL * STEP) - speed) if k else 0.0
            before = seen
            wanted = curve[k] + 64.0 * (reference[k] - seen) + 13.0 * (slope[k] - speed)
            given = a.inertia * wanted + dither[k]
            if k == 0:
                x[5] = given
        position[k], command[k] = x[0], given
        acting = command[max(0, k - late)]
        time = k * STEP
        one = _rates(x, acting, load[k], time, a)
        two = _rates(x + 0.5 * STEP * one, acting, load[k], time, a)
        three = _rates(x + 0.5 * STEP * two, acting, load[k], time, a)
        four = _rates(x + STEP * three, acting, load[k], time, a)
        x = x + STEP / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return position, command


def run(axis: Axis, drive: Drive, length: float) -> tuple[Array, Array, Array, Array]:
    """Time, position, commanded force and load at every step, shape (n,) each."""
    time = np.arange(round(length / STEP)) * STEP
    angle = drive.rates[:, None] * time + drive.phases[:, None]
    sizes, rates = drive.sizes[:, None], drive.rates[:, None]
    reference = (sizes * np.sin(angle)).sum(axis=0)
    slope = (sizes * rates * np.cos(angle)).sum(axis=0)
    curve = -(sizes * rates**2 * np.sin(angle)).sum(axis=0)
    tones = drive.tones[:, None] * time + drive.turns[:, None]
    dither = (drive.dither[:, None] * np.sin(tones)).sum(axis=0)
    load = drive.load * np.sin(drive.load_rate * time + drive.turns[0])
    position, command = _integrated(reference, slope, curve, dither, load, drive.count, axis)
    return time, position, command, load
