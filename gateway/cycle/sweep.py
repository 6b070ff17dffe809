"""A sweep of steady speeds in the place of a regulator (pure).

The sweep has the form of a regulator (gateway.regulators), so that supervisor, limits, command
block and recording work as in any run. It knows no truck and needs no torque. The PLC is in mode
SPEED, in which nobody drives a truck. After the last speed the sweep asks for standstill.
"""

from dataclasses import dataclass, replace
from math import copysign

from gateway.configuration.config import Config
from gateway.configuration.sweep_speeds import Sweep
from gateway.regulators.window import Demand, Window


class Params(Sweep):
    """The configured sweep as the parameters of a regulator."""

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of a configuration that has a sweep."""
        assert config.sweep is not None
        return cls(**vars(config.sweep))


@dataclass(frozen=True, kw_only=True)
class State:
    """Where the sweep is.

    number : index of the present speed
    held : time for which this speed has been held [s]
    motor_speed : last demand [rad/s]
    """

    number: int
    held: float
    motor_speed: float


def seed(params: Params, motor_speed: float, drum_speed: float) -> State:  # noqa: ARG001 - all regulators have these arguments
    """State before the first speed."""
    return State(number=0, held=0.0, motor_speed=max(motor_speed, 0.0))


def update(params: Params, state: State, window: Window) -> tuple[State, Demand]:
    """State and demand one sample later."""
    over = state.number >= len(params.speeds)
    target = 0.0 if over else params.speeds[state.number]
    step = params.rate * window.duration
    way = target - state.motor_speed
    if abs(way) > step:
        rate = copysign(params.rate, way)
        speed = state.motor_speed + rate * window.duration
        return replace(state, motor_speed=speed), Demand(speed=speed, rate=rate)
    held = state.held + window.duration
    after = State(number=state.number, held=held, motor_speed=target)
    if held >= params.hold and not over:
        after = State(number=state.number + 1, held=0.0, motor_speed=target)
    return after, Demand(speed=target)


def follow(params: Params, state: State, demand: float, setpoint: float) -> State:  # noqa: ARG001 - all regulators have these arguments
    """State that continues from the setpoint that the limits passed."""
    return replace(state, motor_speed=setpoint)
