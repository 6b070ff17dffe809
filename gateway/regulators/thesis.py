"""The thesis's regulator (chapter 4): the drum is to turn as the truck's speed would change.

The truck's torque is what the sensor shows, plus friction, plus what turns the drum faster (eq
4.9); less the road load (eq 4.12) it accelerates the truck, whose speed is the reference (eq 4.4).
The inertia term of eq 4.9 is the derivative of a measured speed, integrated at once by eq 4.4; so
it is not differentiated here:

    theta_ref' = rho theta_d' + 1 / (m r_d^2) integral (T_f + xi T_meas - T_RL) dt
    rho = (J_g + J_d) / (m r_d^2),    setpoint of the motor = xi theta_ref'

Friction takes the drum's speed for the gear's (eq 4.8), which is wrong in the backlash. At rest
sgn(0) = 0: friction and rolling resistance vanish. The bench has no reverse: where the reference
would leave its range, the integral is set to what keeps it there. The setpoint is a staircase, as
in the thesis: no slope is sent that the PLC could follow between two writes.
"""

from dataclasses import dataclass, replace

from gateway.configuration.config import Config
from gateway.friction import Friction, friction_torque
from gateway.regulators.window import Demand, Window
from gateway.road_load import RoadLoad, road_load


@dataclass(frozen=True, kw_only=True)
class Params:
    """m r_d^2 [kg m^2], (J_g + J_d) over it [1], r_d [m], xi [1], and the laws of eq 4.8, 4.12."""

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
    """integral : the second term of the reference [rad/s of the drum]"""

    integral: float


def seed(params: Params, motor_speed: float, drum_speed: float) -> State:
    """Integral with which the demand is the measured motor speed."""
    return State(integral=motor_speed / params.gear_ratio - params.rho * drum_speed)


def update(params: Params, state: State, window: Window) -> tuple[State, Demand]:
    """Reference after one new sample."""
    xi, rho, theta_d = params.gear_ratio, params.rho, window.drum_speed
    r_d, dt = params.drum_radius, window.duration
    t_f = friction_torque(theta_d, params.friction)
    t_rl = r_d * params.road.rolling(r_d * theta_d) + r_d * params.road.slope * (theta_d != 0.0)
    growth = (t_f + xi * window.shaft_torque - t_rl) / params.inertia
    if theta_d == 0.0 and window.drum_speed_change == 0.0:
        growth = 0.0  # standing: the sensor shows how the shaft is wound, not what the truck wants
    integral = state.integral + growth * dt
    wanted = xi * (rho * theta_d + integral)
    speed = min(max(wanted, 0.0), params.speed_max)
    integral += (speed - wanted) / xi
    return replace(state, integral=integral), Demand(speed=speed)


def follow(params: Params, state: State, demand: float, setpoint: float) -> State:
    """Integral with which the demand would have been what the limits passed."""
    return replace(state, integral=state.integral + (setpoint - demand) / params.gear_ratio)
