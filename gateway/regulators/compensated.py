"""The compensated regulator: the drum follows a virtual truck, which the real truck's torque
drives (gateway.physics.virtual_truck).

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
  stands until it has earned its start, so that noise and a slow offset do not start it.
"""

from dataclasses import dataclass, replace
from math import exp

from gateway.configuration.config import Config
from gateway.physics.virtual_truck import START_SPEED, VirtualTruck, move, truck_torque
from gateway.physics.window import Window
from gateway.regulators.demand import Demand

TRIM_MOST = 0.8
"""[rad/s] Largest trim, at the drum: the error that the backlash causes at a torque reversal."""
SMOOTH = 0.05
"""[s] Time constant of the drum's acceleration in the slope: noise of one sample is no slope."""
LEAD_MOST = 0.5
"""rho above which the lead is reduced, because it feeds back rho times the acceleration."""


@dataclass(frozen=True, kw_only=True)
class Params(VirtualTruck):
    """Parameters of the regulator in SI: those of the virtual truck, lead [s] and trim [1]."""

    lead: float
    trim: float

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of the configuration."""
        truck = VirtualTruck.of(config)
        return cls(
            **vars(truck),
            lead=config.regulator.lead * min(1.0, LEAD_MOST * truck.inertia / truck.drum_inertia),
            trim=config.regulator.trim,
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
    moving, speed = move(params, state.moving, state.virtual_speed, torque, window.duration)
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


def _clip(value: float, most: float) -> float:
    return min(max(value, -most), most)
