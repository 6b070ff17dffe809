"""The demand with which the drum follows a virtual truck: lead and trim (pure).

The demand leads by the virtual truck's acceleration over the delay of drive and link, so that the
drum does not lag. A share of the drum's speed error is added, which the backlash causes at a
reversal. The slope of the demand is that of truck and trim: a slope that contradicts the next
demand makes a saw-tooth, to which the drive answers with pulses of current.
"""

from dataclasses import dataclass, replace
from math import exp
from typing import TypeVar

from gateway.configuration.config import Config
from gateway.physics.virtual_truck import START_SPEED, VirtualTruck, move
from gateway.physics.window import Window

TRIM_MOST = 0.8
"""[rad/s] Largest trim, at the drum: the error that the backlash causes at a torque reversal."""
SMOOTH = 0.05
"""[s] Time constant of the drum's acceleration in the slope: noise of one sample is no slope."""
LEAD_MOST = 0.5
"""rho above which the lead is reduced, because it feeds back rho times the acceleration."""


@dataclass(frozen=True, kw_only=True)
class FollowedTruck(VirtualTruck):
    """Parameters of the virtual truck, lead [s] and trim [1], in SI."""

    lead: float
    trim: float

    @classmethod
    def of(cls, config: Config) -> "FollowedTruck":
        """Parameters out of the configuration."""
        truck, own = VirtualTruck.of(config), config.regulator
        return FollowedTruck(
            **vars(truck),
            lead=own.lead * min(1.0, LEAD_MOST * truck.inertia / truck.drum_inertia),
            trim=own.trim,
        )


@dataclass(frozen=True, kw_only=True)
class Following:
    """Speed of the virtual truck [rad/s of the drum], and whether it has started.

    drum_acceleration : of the drum itself, smoothed [rad/s^2]
    """

    virtual_speed: float
    moving: bool
    drum_acceleration: float = 0.0


State = TypeVar("State", bound=Following)


def seed(params: FollowedTruck, motor_speed: float, drum_speed: float) -> Following:
    """State whose demand is the measured motor speed [rad/s]."""
    gear_speed = motor_speed / params.gear_ratio
    behind = (gear_speed - drum_speed) / (1.0 + params.trim)
    virtual = gear_speed - _clip(params.trim * behind, TRIM_MOST)
    return Following(virtual_speed=max(virtual, 0.0), moving=gear_speed > START_SPEED)


def advance(
    params: FollowedTruck, state: State, torque: float, window: Window
) -> tuple[State, float]:
    """State after a window, and the truck's acceleration [rad/s^2]; 0 where it started.

    torque : of the truck on the drum [N m]
    """
    moving, speed = move(params, state.moving, state.virtual_speed, torque, window.duration)
    rise = window.drum_speed_change / window.duration
    smoothed = rise + (state.drum_acceleration - rise) * exp(-window.duration / SMOOTH)
    after = replace(state, virtual_speed=speed, moving=moving, drum_acceleration=smoothed)
    return after, (speed - state.virtual_speed) / window.duration if state.moving else 0.0


def lead_and_trim(
    params: FollowedTruck,
    state: Following,
    acceleration: float,
    window: Window,
    planned: tuple[float, float] = (0.0, 0.0),
) -> tuple[float, float]:
    """Demanded motor speed [rad/s] and its slope [rad/s^2]; 0, 0 where the truck stands.

    acceleration : of the virtual truck [rad/s^2]
    planned : speed [rad/s] and slope [rad/s^2] of the gear relative to the truck
    """
    if not state.moving:
        return 0.0, 0.0
    speed, (ahead, turning) = state.virtual_speed, planned
    trim = _clip(params.trim * (speed - window.drum_speed), TRIM_MOST)
    wanted = params.gear_ratio * (speed + params.lead * acceleration + trim + ahead)
    demanded = min(max(wanted, 0.0), params.speed_max)
    if abs(trim) < TRIM_MOST:
        turning += params.trim * (acceleration - state.drum_acceleration)
    rate = params.gear_ratio * (acceleration + turning) if demanded == wanted else 0.0
    return demanded, rate


def follow(params: FollowedTruck, state: State, demand: float, setpoint: float) -> State:
    """State whose demand would have been the setpoint that the limits passed [rad/s]."""
    change = (setpoint - demand) / params.gear_ratio / (1.0 + params.trim)
    return replace(state, virtual_speed=max(state.virtual_speed + change, 0.0))


def _clip(value: float, most: float) -> float:
    return min(max(value, -most), most)
