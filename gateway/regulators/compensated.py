"""The compensated regulator: the drum follows a virtual truck, which the real truck's torque
drives (gateway.physics.virtual_truck).

It differs from the regulator of the thesis in four points.
- Friction: it follows from the motor speed, which is the gear's speed inside the backlash, too. A
  small share is left out, because an overcompensated friction runs away (slowly, above 1 rad/s).
- Torque: it is the torque over exactly the window of the speed difference. The inertia term then
  cancels the torque of the bench's own acceleration.
- Lead and trim: the demand leads by the virtual truck's acceleration, and a share of the drum's
  speed error is added (gateway.physics.following).
- Standstill: while the gear sticks, the sensor shows friction and truck together. The virtual truck
  stands until it has earned its start, so that noise and a slow offset do not start it.
"""

from typing import TypeAlias

from gateway.physics.following import FollowedTruck, Following, advance, follow, lead_and_trim, seed
from gateway.physics.virtual_truck import truck_torque
from gateway.physics.window import Window
from gateway.regulators.demand import Demand

__all__ = ["Params", "State", "follow", "seed", "update"]

Params: TypeAlias = FollowedTruck
State: TypeAlias = Following


def update(params: Params, state: State, window: Window) -> tuple[State, Demand]:
    """State and demand after one new sample."""
    after, acceleration = advance(params, state, truck_torque(params, window), window)
    speed, rate = lead_and_trim(params, after, acceleration, window)
    return after, Demand(speed=speed, rate=rate)
