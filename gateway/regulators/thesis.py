"""The regulator of the thesis (chapter 4): the drum turns as the speed of the truck would change.

The torque of the truck is the torque of the sensor plus friction plus the torque that accelerates
the drum (eq 4.9). It accelerates the truck against the road load (eq 4.12), and the speed of the
truck is the reference (eq 4.4). Eq 4.9 differentiates a measured speed, which eq 4.4 integrates
again. Both steps cancel, so that nothing is differentiated here:

    theta_ref' = rho theta_d' + 1 / (m r_d^2) integral (T_f + xi T_meas - T_RL) dt
    rho = (J_g + J_d) / (m r_d^2),    setpoint of the motor = xi theta_ref'

Friction uses the drum's speed for the gear's speed (eq 4.8), which is wrong in the backlash. At
rest sgn(0) = 0, so that friction and rolling resistance vanish. The bench has no reverse: where the
reference would leave its range, the integral is set so that the reference stays at the end of the
range. The setpoint is a staircase as in the thesis, without a slope between two writes.
"""

from dataclasses import dataclass, replace

from gateway.configuration.config import Config
from gateway.friction.law import Friction, friction_torque
from gateway.physics.road_load import RoadLoad, road_load
from gateway.physics.window import Window
from gateway.regulators.demand import Demand


@dataclass(frozen=True, kw_only=True)
class Params:
    """Parameters of the regulator in SI.

    inertia : m r_d^2; rho : (J_g + J_d) / (m r_d^2); drum_radius : r_d; gear_ratio : xi
    friction, road : laws of eq 4.8 and 4.12
    """

    inertia: float
    rho: float
    drum_radius: float
    gear_ratio: float
    friction: Friction
    road: RoadLoad
    speed_max: float

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of the configuration."""
        bench, truck = config.bench, config.truck
        inertia = truck.total_mass * bench.drum_radius**2
        return cls(
            inertia=inertia,
            rho=(bench.gear_inertia + bench.drum_inertia) / inertia,
            drum_radius=bench.drum_radius,
            gear_ratio=bench.gear_ratio,
            friction=config.regulator.friction,
            road=road_load(truck, bench),
            speed_max=config.limits.speed_max,
        )


@dataclass(frozen=True, kw_only=True)
class State:
    """The integral in the reference [rad/s of the drum]."""

    integral: float


def seed(params: Params, motor_speed: float, drum_speed: float) -> State:
    """State whose demand is the measured motor speed."""
    return State(integral=motor_speed / params.gear_ratio - params.rho * drum_speed)


def update(params: Params, state: State, window: Window) -> tuple[State, Demand]:
    """State and demand after one new sample."""
    xi, rho, theta_d = params.gear_ratio, params.rho, window.drum_speed
    r_d, dt = params.drum_radius, window.duration
    t_f = friction_torque(theta_d, params.friction)
    t_rl = r_d * params.road.rolling(r_d * theta_d) + r_d * params.road.slope * (theta_d != 0.0)
    growth = (t_f + xi * window.shaft_torque - t_rl) / params.inertia
    if theta_d == 0.0 and window.drum_speed_change == 0.0:
        growth = 0.0  # at standstill the sensor shows the twist of the shaft, not the truck
    integral = state.integral + growth * dt
    wanted = xi * (rho * theta_d + integral)
    speed = min(max(wanted, 0.0), params.speed_max)
    integral += (speed - wanted) / xi
    return replace(state, integral=integral), Demand(speed=speed)


def follow(params: Params, state: State, demand: float, setpoint: float) -> State:
    """State whose demand would have been the setpoint that the limits passed."""
    return replace(state, integral=state.integral + (setpoint - demand) / params.gear_ratio)
