"""The compensated regulator: the drum follows a virtual truck, which the real truck's torque
drives.

It differs from the regulator of the thesis in four points.
- Friction: it follows from the motor speed, which is the gear's speed inside the backlash, too. A
  small share is left out, because an overcompensated friction runs away (slowly, above 1 rad/s).
- Torque: it is the torque over exactly the window of the speed difference. The inertia term then
  cancels the torque of the bench's own acceleration.
- Lead and trim: the demand leads by the virtual truck's acceleration over the delay of drive and
  link, so that the drum does not lag. A share of the drum's speed error is added, which the
  backlash causes at a reversal. The slope of the demand is that of truck and trim: a slope that
  contradicts the next demand makes a saw-tooth, to which the drive answers with pulses of current.
- Standstill: while the gear sticks, the sensor shows friction and truck together. The virtual truck
  stands until the impulse above road load and margin is worth START_SPEED, and then has this speed.
  So noise and a slow offset do not start it, and a real start loses nothing. Inside the backlash
  the sensor sees no truck, and the torque there is the torque that accelerates the drum.
"""

from dataclasses import dataclass, replace
from math import exp

from gateway.configuration.config import Config
from gateway.friction.law import Friction, bearing_torque, friction_torque, load_loss
from gateway.physics.road_load import RoadLoad, road_load
from gateway.regulators.window import Demand, Window

SLOW = 0.5
"""[rad/s] Drum speed up to which less of the friction may be compensated. In cruise, 1 % of the
friction is 3 % of the truck's force."""
START_SPEED = 0.01
"""[rad/s] Drum speed with which a standing truck starts."""
STICK_SPEED = 0.005
"""[rad/s] Speed of the gear output below which its friction has any value up to f_gc."""
TRIM_MOST = 0.8
"""[rad/s] Largest trim, at the drum: the error that the backlash causes at a torque reversal."""
SMOOTH = 0.05
"""[s] Time constant of the drum's acceleration in the slope: noise of one sample is no slope."""
LEAD_MOST = 0.5
"""rho above which the lead is reduced, because it feeds back rho times the acceleration."""


@dataclass(frozen=True, kw_only=True)
class Params:
    """Parameters of the regulator in SI.

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
    lead: float
    trim: float
    under_compensation: float
    under_compensation_slow: float
    breakaway: float

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of the configuration."""
        bench, truck, own = config.bench, config.truck, config.regulator
        inertia = truck.total_mass * bench.drum_radius**2
        drum_inertia = bench.gear_inertia + bench.drum_inertia
        return cls(
            inertia=inertia,
            drum_inertia=drum_inertia,
            drum_radius=bench.drum_radius,
            gear_ratio=bench.gear_ratio,
            friction=own.friction,
            road=road_load(truck, bench),
            speed_max=config.limits.speed_max,
            lead=own.lead * min(1.0, LEAD_MOST * inertia / drum_inertia),
            trim=own.trim,
            under_compensation=own.under_compensation,
            under_compensation_slow=own.under_compensation_slow,
            breakaway=own.breakaway,
        )


@dataclass(frozen=True, kw_only=True)
class State:
    """Speed of the virtual truck [rad/s of the drum], and whether it has started.

    drum_acceleration : of the drum itself, smoothed [rad/s^2]
    """

    virtual_speed: float
    moving: bool
    drum_acceleration: float = 0.0


def seed(params: Params, motor_speed: float, drum_speed: float) -> State:
    """State whose demand is the measured motor speed."""
    gear_speed = motor_speed / params.gear_ratio
    behind = (gear_speed - drum_speed) / (1.0 + params.trim)
    virtual = gear_speed - _clip(params.trim * behind, TRIM_MOST)
    return State(virtual_speed=max(virtual, 0.0), moving=gear_speed > START_SPEED)


def update(params: Params, state: State, window: Window) -> tuple[State, Demand]:
    """State and demand after one new sample."""
    torque = truck_torque(params, window)
    moving, speed = _move(params, state, torque, window.duration)
    rise = window.drum_speed_change / window.duration
    smoothed = rise + (state.drum_acceleration - rise) * exp(-window.duration / SMOOTH)
    after = State(virtual_speed=speed, moving=moving, drum_acceleration=smoothed)
    if not moving:
        return after, Demand(speed=0.0)
    acceleration = (speed - state.virtual_speed) / window.duration if state.moving else 0.0
    trim = _clip(params.trim * (speed - window.drum_speed), TRIM_MOST)
    wanted = params.gear_ratio * (speed + params.lead * acceleration + trim)
    demanded = min(max(wanted, 0.0), params.speed_max)
    turning = params.trim * (acceleration - smoothed) if abs(trim) < TRIM_MOST else 0.0
    rate = params.gear_ratio * (acceleration + turning) if demanded == wanted else 0.0
    return after, Demand(speed=demanded, rate=rate)


def follow(params: Params, state: State, demand: float, setpoint: float) -> State:
    """State whose demand would have been the setpoint that the limits passed."""
    change = (setpoint - demand) / params.gear_ratio / (1.0 + params.trim)
    return replace(state, virtual_speed=max(state.virtual_speed + change, 0.0))


def truck_torque(params: Params, window: Window) -> float:
    """Mean torque of the truck on the drum over the window [N m].

    T_w' = (J_g + J_d) theta_d'' + T_f(theta_m' / xi) + xi T_meas           (thesis, eq 4.9)

    T_f : with the losses by load and in the drum's bearings, where the friction has them
    """
    measured = params.gear_ratio * window.shaft_torque
    accelerating = params.drum_inertia * window.drum_speed_change / window.duration
    return accelerating + measured + _friction(params, window, measured)


def _friction(params: Params, window: Window, measured: float) -> float:
    gear_speed = window.motor_speed / params.gear_ratio
    if abs(gear_speed) < STICK_SPEED:
        return _clip(-measured, params.friction.breakaway)
    least, most = params.under_compensation, params.under_compensation_slow
    slow = max(0.0, 1.0 - abs(gear_speed) / SLOW)
    share = 1.0 - least - max(0.0, most - least) * slow
    law = params.friction
    gear = friction_torque(gear_speed, law, window.shell_temperature, window.oil_temperature)
    loaded = load_loss(-measured - gear, gear_speed, law)
    return share * (gear + loaded + bearing_torque(window.drum_speed, law))


def _move(params: Params, state: State, torque: float, duration: float) -> tuple[bool, float]:
    """Whether the virtual truck moves after this torque [N m], and its speed [rad/s]."""
    r_d, before = params.drum_radius, state.virtual_speed
    if state.moving:
        road = r_d * params.road.force(r_d * max(before, 1e-9))
        speed = min(before + (torque - road) / params.inertia * duration, _top_speed(params))
        return speed > 0.0, max(speed, 0.0)
    threshold = r_d * params.road.breakaway + params.breakaway
    earned = max(before + (torque - threshold) / params.inertia * duration, 0.0)
    return earned > START_SPEED, earned


def _top_speed(params: Params) -> float:
    return params.speed_max / params.gear_ratio


def _clip(value: float, most: float) -> float:
    return min(max(value, -most), most)
