"""A truck on a level road, driven by the measured torque of its motor (pure).

    m dv/dt = F_w - m g (C_rr + C_rr,v |v| / r_d) sgn v          (thesis, eq 4.14-4.16 over r_w)
    F_w = xi T eta / r_w     where the motor drives, T v > 0               (thesis, eq 4.13)
    F_w = xi T / (eta r_w)   where it brakes: the loss of the gear then helps to brake
    T_shown = gain T + offset

The thesis multiplies by the efficiency in both directions, so its brakes are too weak by 1 - eta^2.
Here the torque that flows back through the gear is divided by the efficiency. A truck at rest
stays at rest until the motor overcomes C_rr.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_emulator.model.dimensions import DRUM_RADIUS, TRUCK_RATIO, WHEEL_RADIUS
from plant_emulator.road_load.kernel import compile_loop, travel
from plant_emulator.simulation.truck import GRAVITY

if TYPE_CHECKING:
    from plant_emulator.road_load.signal import Mask
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Truck:
    """Given properties of the truck and of the bench.

    mass : with load [kg]; ratio : motor speed over wheel speed [1]; wheel_radius [m]
    drum_radius : of the bench [m], because C_rr,v refers to the drum's speed
    """

    mass: float
    ratio: float = TRUCK_RATIO
    wheel_radius: float = WHEEL_RADIUS
    drum_radius: float = DRUM_RADIUS

    @property
    def weight(self) -> float:
        """Weight m g [N]."""
        return self.mass * GRAVITY


@dataclass(frozen=True, kw_only=True)
class RoadParameters:
    """The estimated parameters.

    crr : rolling resistance C_rr [1]; crr_v : its increase per drum speed C_rr,v [s]
    efficiency : of the truck's gear eta [1]
    torque_gain [1], torque_offset [N m] : of the load cell
    clock_ahead [s], clock_skew [1] : a velocity sample with time stamp t was taken at
        t + clock_skew (t - t_0) + clock_ahead on the torque's clock; t_0 is the first stamp
    initial_velocity : at the start of the common window [m/s]
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

    shown : measured torque, linear between its samples [N m], shape (n,)
    held : samples at which the truck is known to stand, shape (n,)
    period : of the samples [s]
    """
    p = parameters
    torque = (shown - p.torque_offset) / p.torque_gain
    per_torque = truck.ratio / (truck.wheel_radius * truck.mass)
    found: Array = compile_loop(travel)(
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
