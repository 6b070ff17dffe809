"""Stability of the sampled loop of regulator, link, drive and drum, and the smallest stable mass.

With exact parameters the regulator cancels the bench's inertia and friction. The loop that remains
is rho G (D - F): the drive G with its dead time, the path D of the drum's speed, the path F of the
torque. D = F cancels for every mass and delay. D and F differ when the torque is a momentary value
while the speed difference spans a window, when their filters differ, and by the lead.

The loop is linear and has the period of the poll. Its stability follows from the eigenvalues of the
map from one poll to the next (Floquet). The map is built by sending all unit states through one
period in steps of 1 ms: speed of the drum in contact, reference in its dead time, filters, and the
regulator at the end. One eigenvalue is always 1, because driver and road close the loop of the
truck's speed.
"""

from dataclasses import dataclass
from math import exp

import numpy as np

from gateway.arrays import Array

SIMULATION_STEP = 1e-3
DRIVE = 105.0
"""[rad/s] Bandwidth of the speed loop. It is 133 below base speed and 70 at 14 km/h. With this
value and without lead, the smallest stable masses are those of the tests within about 10 %."""
CONTACT = 385.0
"""[1/s] Damping of the backlash shaft in contact over the drum's inertia (thesis, Table 3.1)."""
ROOT_MARGIN = 1e-7
"""Excess of an eigenvalue over 1 that counts as rounding."""
LIGHTEST_TRIED, HEAVIEST_TRIED = 60.0, 20000.0
"""[kg] Range of masses that is searched for the smallest stable one."""


@dataclass(frozen=True, kw_only=True)
class SpeedLoop:
    """Properties of the loop that decide on its stability. Times [s].

    averaged : the torque is the mean over the window of the speed difference, otherwise at its end
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


def spectral_radius(loop: SpeedLoop, rho: float) -> float:
    """Largest modulus of the eigenvalues from poll to poll [1]; above 1 the loop is unstable.

    rho : inertia of the drum over that of the truck, at the rim [1]
    """
    period_map = _one_period(loop, rho, np.eye(_size(loop)))
    return float(np.abs(np.linalg.eigvals(period_map)).max())


def is_stable(loop: SpeedLoop, rho: float) -> bool:
    """Whether the loop is stable."""
    return spectral_radius(loop, rho) <= 1.0 + ROOT_MARGIN


def smallest_mass(loop: SpeedLoop, inertia: float) -> float:
    """Mass above which every truck is stable [kg]; 0: the lightest tried, 60 kg, is stable, too.

    inertia : J_d / r_d^2, the mass at which rho is 1 [kg]
    """
    masses = np.geomspace(HEAVIEST_TRIED, LIGHTEST_TRIED, 60)
    stable = HEAVIEST_TRIED
    for mass in masses:
        if not is_stable(loop, inertia / mass):
            return _bisect(loop, inertia, float(mass), stable)
        stable = float(mass)
    return 0.0


def _bisect(loop: SpeedLoop, inertia: float, unstable: float, stable: float) -> float:
    while stable - unstable > 1.0:
        middle = 0.5 * (stable + unstable)
        if is_stable(loop, inertia / middle):
            stable = middle
        else:
            unstable = middle
    return stable


def _size(loop: SpeedLoop) -> int:
    """Size of the state: seven values and the references in the dead time."""
    return 7 + round(loop.dead_time / SIMULATION_STEP)


def _one_period(loop: SpeedLoop, rho: float, states: Array) -> Array:
    """States one poll later, a column each. The torque is in units of the drum's inertia: T = -w'.

    g, w : speed of gear and drum; tau, y : filtered torque and speed; before : y at the last poll
    v : speed of the truck; reference : the newest one; the rest of the state is in the dead time
    """
    g, w, tau, y, before, v, reference = states[:7]
    delayed = list(states[7:])
    steps = round(loop.period / SIMULATION_STEP)
    follow, meet, smooth_torque, smooth_speed = (
        1.0 - exp(-DRIVE * SIMULATION_STEP),
        1.0 - exp(-CONTACT * SIMULATION_STEP),
        _share(loop.torque_filter),
        _share(loop.speed_filter),
    )
    impulse = np.zeros_like(g)
    for _ in range(steps):
        delayed.append(reference)
        g = g + follow * (delayed.pop(0) - g)
        change = meet * (g - w)
        w = w + change
        tau = tau + smooth_torque * (-change / SIMULATION_STEP - tau)
        y = y + smooth_speed * (w - y)
        impulse = impulse + tau * SIMULATION_STEP
    torque = impulse / loop.period if loop.averaged else tau
    gain = rho * (1.0 + loop.inertia_error)
    growth = gain * (y - before) + rho * torque * loop.period
    v = v + growth
    reference = v + loop.lead * growth / loop.period + loop.trim * (v - y)
    return np.array([g, w, tau, y, y, v, reference, *delayed])


def _share(time_constant: float) -> float:
    """Share of the step response of a first-order filter after one step; 1 without a filter."""
    return 1.0 - exp(-SIMULATION_STEP / time_constant) if time_constant > 0.0 else 1.0
