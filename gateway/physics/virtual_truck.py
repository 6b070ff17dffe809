"""The virtual truck: a truck on its road, which the torque of the real truck drives (pure).

Inside the backlash the sensor sees no truck, and the torque there is the torque that accelerates
the drum. While the gear sticks, the sensor shows friction and truck together. The virtual truck
stands until the impulse above road load and margin is worth START_SPEED, and then has this speed.
So noise and a slow offset do not start it, and a real start loses nothing.
"""

from dataclasses import dataclass

from gateway.configuration.config import Config
from gateway.friction.law import Friction, bearing_torque, friction_torque, load_loss
from gateway.physics.road_load import RoadLoad, road_load
from gateway.physics.window import Window

SLOW = 0.5
"""[rad/s] Drum speed up to which less of the friction may be compensated. In cruise, 1 % of the
friction is 3 % of the truck's force."""
START_SPEED = 0.01
"""[rad/s] Drum speed with which a standing truck starts."""
STICK_SPEED = 0.005
"""[rad/s] Speed of the gear output below which its friction has any value up to f_gc."""


@dataclass(frozen=True, kw_only=True)
class VirtualTruck:
    """Parameters of the truck on its road, and of the bench that shows its torque, in SI.

    inertia : m r_d^2 of the truck; drum_inertia : of gear and drum [kg m^2]
    friction, road : laws of eq 4.8 and 4.12; the other fields stand in the configuration
    """

    inertia: float
    drum_inertia: float
    drum_radius: float
    gear_ratio: float
    friction: Friction
    road: RoadLoad
    speed_max: float
    under_compensation: float
    under_compensation_slow: float
    breakaway: float

    @classmethod
    def of(cls, config: Config) -> "VirtualTruck":
        """Parameters out of the configuration."""
        bench, truck, own = config.bench, config.truck, config.regulator
        return VirtualTruck(
            inertia=truck.total_mass * bench.drum_radius**2,
            drum_inertia=bench.gear_inertia + bench.drum_inertia,
            drum_radius=bench.drum_radius,
            gear_ratio=bench.gear_ratio,
            friction=own.friction,
            road=road_load(truck, bench),
            speed_max=config.limits.speed_max,
            under_compensation=own.under_compensation,
            under_compensation_slow=own.under_compensation_slow,
            breakaway=own.breakaway,
        )


def truck_torque(params: VirtualTruck, window: Window) -> float:
    """Mean torque of the truck on the drum over the window [N m].

    T_w' = (J_g + J_d) theta_d'' + T_f(theta_m' / xi) + xi T_meas           (thesis, eq 4.9)

    T_f : with the losses by load and in the drum's bearings, where the friction has them
    """
    measured = params.gear_ratio * window.shaft_torque
    accelerating = params.drum_inertia * window.drum_speed_change / window.duration
    return accelerating + measured + _friction(params, window, measured)


def _friction(params: VirtualTruck, window: Window, measured: float) -> float:
    gear_speed = window.motor_speed / params.gear_ratio
    if abs(gear_speed) < STICK_SPEED:
        most = params.friction.breakaway
        return min(max(-measured, -most), most)
    least, most = params.under_compensation, params.under_compensation_slow
    slow = max(0.0, 1.0 - abs(gear_speed) / SLOW)
    share = 1.0 - least - max(0.0, most - least) * slow
    law = params.friction
    gear = friction_torque(gear_speed, law, window.shell_temperature, window.oil_temperature)
    loaded = load_loss(-measured - gear, gear_speed, law)
    return share * (gear + loaded + bearing_torque(window.drum_speed, law))


def move(
    params: VirtualTruck, moving: bool, before: float, torque: float, duration: float
) -> tuple[bool, float]:
    """Whether the virtual truck moves after a window, and its speed at the drum [rad/s].

    moving, before : the same before the window; a standing truck has the speed that it has earned
    torque : of the truck on the drum [N m]; duration : of the window [s]
    """
    r_d = params.drum_radius
    if moving:
        road = r_d * params.road.force(r_d * max(before, 1e-9))
        top = params.speed_max / params.gear_ratio
        speed = min(before + (torque - road) / params.inertia * duration, top)
        return speed > 0.0, max(speed, 0.0)
    threshold = r_d * params.road.breakaway + params.breakaway
    earned = max(before + (torque - threshold) / params.inertia * duration, 0.0)
    return earned > START_SPEED, earned
