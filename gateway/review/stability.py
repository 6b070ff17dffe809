"""Whether the sampled loop of regulator, link, drive and drum is stable, and from which mass on.

With exact parameters the regulator cancels the bench's inertia and friction; what is left of the
loop is rho G (D - F): the drive G with its dead time, the path D of the drum's speed against the
path F of the torque. D = F cancels for every mass and delay. They differ when the torque is read at
an instant while the speed difference spans a window, when their filters differ, or by lead.

The loop is linear and has the period of the poll, so its stability is told by the eigenvalues of
the map from one poll to the next (Floquet). The map is built by sending each unit state through one
period in steps of 1 ms: speed of the drum in contact, reference in its dead time, filters, and the
regulator at the end. One eigenvalue is always 1: with constant road load the truck's speed is
neutral, driver and road close that loop.
"""

from dataclasses import dataclass
from math import exp

import numpy as np

from gateway.arrays import Array

STEP = 1e-3
DRIVE = 105.0
"""[rad/s] Bandwidth of the speed loop. It is 133 below base speed and 70 at 14 km/h. With this
value and without lead, the smallest stable masses are those of the tests within about 10 %."""
CONTACT = 385.0
"""[1/s] damping of the backlash shaft in contact over the drum's inertia (thesis, Table 3.1)."""
MARGIN = 1e-7
"""By which an eigenvalue may exceed 1 for the rounding of its computation."""
LIGHTEST, HEAVIEST = 60.0, 20000.0


@dataclass(frozen=True, kw_only=True)
class Loop:
    """What decides on stability. Times [s].

    averaged : torque is the mean over the window of the speed difference, else that at its end
    torque_filter, speed_filter : time constants of first-order filters, 0: none
    inertia_error : of the drum's inertia as the regulator knows it, relative
    trim : gain on virtual minus drum speed
    """

    period: float
    dead_time: float
    averaged: bool
    torque_filter: float = 0.0
    speed_filter: float = 0.0
    lead: float = 0.0
    trim: float = 0.0
    inertia_error: float = 0.0


def spectral_radius(loop: Loop, rho: float) -> float:
    """Largest modulus of the eigenvalues of the loop from poll to poll; over 1: it grows."""
    size = _size(loop)
    period_map = np.column_stack([_period(loop, rho, unit) for unit in np.eye(size)])
    return float(np.abs(np.linalg.eigvals(period_map)).max())


def is_stable(loop: Loop, rho: float) -> bool:
    """Whether nothing grows."""
    return spectral_radius(loop, rho) <= 1.0 + MARGIN


def smallest_mass(loop: Loop, inertia: float) -> float:
    """Mass from which on every heavier truck is stable [kg]; 0: also the lightest tried, 60 kg.

    inertia : J_d / r_d^2, mass at which rho is 1 [kg]
    """
    masses = np.geomspace(HEAVIEST, LIGHTEST, 60)
    stable = HEAVIEST
    for mass in masses:
        if not is_stable(loop, inertia / mass):
            return _bisected(loop, inertia, float(mass), stable)
        stable = float(mass)
    return 0.0


def _bisected(loop: Loop, inertia: float, unstable: float, stable: float) -> float:
    while stable - unstable > 1.0:
        middle = 0.5 * (stable + unstable)
        if is_stable(loop, inertia / middle):
            stable = middle
        else:
            unstable = middle
    return stable


def _size(loop: Loop) -> int:
    """Gear, drum, filters, sampled speed, virtual speed, reference, and those in the dead time."""
    return 7 + round(loop.dead_time / STEP)


def _period(loop: Loop, rho: float, state: Array) -> Array:
    """State one poll later. The torque is counted in units of the drum's inertia: T = -w'.

    g, w : gear and drum; tau, y : filtered torque and speed; before : y at the last poll
    v : speed of the truck
    """
    g, w, tau, y, before, v, reference = (float(value) for value in state[:7])
    delayed = list(state[7:])
    steps = round(loop.period / STEP)
    follow, meet, smooth_torque, smooth_speed = (
        1.0 - exp(-DRIVE * STEP),
        1.0 - exp(-CONTACT * STEP),
        _share(loop.torque_filter),
        _share(loop.speed_filter),
    )
    impulse = 0.0
    for _ in range(steps):
        delayed.append(reference)
        g += follow * (delayed.pop(0) - g)
        change = meet * (g - w)
        w += change
        tau += smooth_torque * (-change / STEP - tau)
        y += smooth_speed * (w - y)
        impulse += tau * STEP
    torque = impulse / loop.period if loop.averaged else tau
    gain = rho * (1.0 + loop.inertia_error)
    growth = gain * (y - before) + rho * torque * loop.period
    v += growth
    reference = v + loop.lead * growth / loop.period + loop.trim * (v - y)
    return np.array([g, w, tau, y, y, v, reference, *delayed])


def _share(time_constant: float) -> float:
    """Share of the step response of a first-order filter that one step brings."""
    return 1.0 - exp(-STEP / time_constant) if time_constant > 0.0 else 1.0
