"""A truck on the level road, driven by the torque of its motor as its load cell shows it (pure).

    m dv/dt = F_w - m g (C_rr + C_rr,v |v| / r_d) sgn v          (thesis, eq 4.14-4.16 over r_w)
    F_w = xi T eta / r_w     where the motor drives, T v > 0               (thesis, eq 4.13)
    F_w = xi T / (eta r_w)   where it brakes: the loss of the gear then helps to brake
    T_shown = gain T + offset

The thesis multiplies by the efficiency in both directions, which makes the brakes 1 - eta^2 too
weak; power that flows back through a gear is divided by it. At rest the truck stays until the motor
overcomes C_rr. Clocks, filters and estimation are left to the other `road_*` modules.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_emulator.road_load.kernel import compiled, travelled
from plant_emulator.simulation.truck import GRAVITY

if TYPE_CHECKING:
    from plant_emulator.road_load.signal import Mask
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Truck:
    """What is known of the truck: mass with load [kg], ratio [1], radii of wheel and drum [m]."""

    mass: float
    ratio: float = 14.0
    wheel_radius: float = 0.1715
    drum_radius: float = 0.645

    @property
    def weight(self) -> float:
        """m g [N]"""
        return self.mass * GRAVITY


@dataclass(frozen=True, kw_only=True)
class RoadParameters:
    """What the logs are asked for.

    crr, crr_v : rolling resistance [1], and its part with the drum's speed [s]
    efficiency : of the truck's gear; torque_gain [1], torque_offset [N m] : of the load cell
    clock_ahead [s], clock_skew [1] : the velocity sample stamped t belongs to the torque's time
        t + clock_skew (t - t_0) + clock_ahead, t_0 the first stamp of the velocity
    initial_velocity : where the logs begin on the move [m/s]
    """

    crr: float
    crr_v: float
    efficiency: float
    torque_gain: float
    torque_offset: float
    clock_ahead: float
    clock_skew: float
    initial_velocity: float


def velocity(
    parameters: RoadParameters, truck: Truck, shown: Array, held: Mask, period: float
) -> Array:
    """Velocity of the truck [m/s] at each sample of the torque, shape (n,).

    shown : torque as the load cell shows it [N m], linear between its samples, shape (n,)
    held : where the truck is known to stand, whatever holds it, shape (n,)
    period : of the samples [s]
    """
    p = parameters
    torque = (shown - p.torque_offset) / p.torque_gain
    per_torque = truck.ratio / (truck.wheel_radius * truck.mass)
    found: Array = compiled(travelled)(
        torque,
        held,
        period,
        per_torque * p.efficiency,
        per_torque / p.efficiency,
        GRAVITY * p.crr,
        GRAVITY * p.crr_v / truck.drum_radius,
        p.initial_velocity,
    )
    return found
