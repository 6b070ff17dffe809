"""The steps of a program in the place of a regulator (pure).

A program has the form of a regulator (gateway.regulators), so that supervisor, limits, command
block and recording work as in any run. The PLC is in mode SPEED, in which nobody drives a truck.
After its last step the program asks for standstill.

In an emulation the configured regulator works for a truck that is not there. The force on that
truck is added to the measured shaft torque, where the torque of a real truck would appear.
"""

from dataclasses import dataclass, replace
from math import copysign
from typing import Any

from gateway import regulators
from gateway.configuration.config import Config
from gateway.configuration.program import Emulation, Profile, Ramp, Step
from gateway.physics.window import Window
from gateway.regulators import Regulator
from gateway.regulators.demand import Demand
from register_maps.logs.drive_programs import interpolate

NOTHING = Demand(speed=0.0)


@dataclass(frozen=True, kw_only=True)
class Params:
    """Parameters of a program in SI.

    steps : in their order; trucks : parameters of the regulator for each step, None: not needed
    """

    steps: tuple[Step, ...]
    trucks: tuple[Any, ...]
    regulator: Regulator
    drum_radius: float
    gear_ratio: float

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of a configuration that has a program."""
        assert config.program is not None
        regulator = regulators.load(config.regulator.name)
        return cls(
            steps=config.program.steps,
            trucks=tuple(_truck(config, regulator, step) for step in config.program.steps),
            regulator=regulator,
            drum_radius=config.bench.drum_radius,
            gear_ratio=config.bench.gear_ratio,
        )


def _truck(config: Config, regulator: Regulator, step: Step) -> Any:
    """Parameters of the regulator for the truck of a step; None where it has no truck."""
    if not isinstance(step, Emulation):
        return None
    truck = replace(
        config.truck, mass=step.mass, load=0.0, f0=step.f0, f1=step.f1, f2=step.f2, grade=0.0
    )
    return regulator.Params.of(replace(config, truck=truck))


@dataclass(frozen=True, kw_only=True)
class State:
    """State of a program: its place among the steps.

    number : index of the present step; its count after the last one
    time : since the begin of the step, in a ramp since its end [s]
    motor_speed : last demand [rad/s]
    regulator : state of the regulator in an emulation
    """

    number: int
    time: float
    motor_speed: float
    regulator: Any = None


def seed(params: Params, motor_speed: float, drum_speed: float) -> State:  # noqa: ARG001 - all regulators have these arguments
    """State before the first step; speeds : of motor and drum [rad/s]."""
    return State(number=0, time=0.0, motor_speed=max(motor_speed, 0.0))


def is_over(params: Params, state: State) -> bool:
    """Whether the last step has come to its end."""
    return state.number >= len(params.steps)


def update(params: Params, state: State, window: Window) -> tuple[State, Demand]:
    """State and demand one sample later."""
    if is_over(params, state):
        return replace(state, motor_speed=0.0), NOTHING
    match params.steps[state.number]:
        case Profile() as step:
            return _follow_profile(step, state, window)
        case Ramp() as step:
            return _follow_ramp(step, state, window)
        case Emulation() as step:
            return _emulate(params, step, state, window)


def _next_step(state: State) -> State:
    return State(number=state.number + 1, time=0.0, motor_speed=state.motor_speed)


def _follow_profile(step: Profile, state: State, window: Window) -> tuple[State, Demand]:
    time = state.time + window.duration
    speed = interpolate(step.times, step.speeds, time)
    after = replace(state, time=time, motor_speed=speed)
    if time >= step.duration:
        return _next_step(after), Demand(speed=speed)
    soon = min(time + window.duration, step.duration)
    rate = (interpolate(step.times, step.speeds, soon) - speed) / (soon - time)
    return after, Demand(speed=speed, rate=rate)


def _follow_ramp(step: Ramp, state: State, window: Window) -> tuple[State, Demand]:
    way = step.speed - state.motor_speed
    if abs(way) > step.rate * window.duration:
        rate = copysign(step.rate, way)
        speed = state.motor_speed + rate * window.duration
        return replace(state, motor_speed=speed), Demand(speed=speed, rate=rate)
    held = state.time + window.duration
    after = replace(state, time=held, motor_speed=step.speed)
    return _next_step(after) if held >= step.hold else after, Demand(speed=step.speed)


def _emulate(params: Params, step: Emulation, state: State, window: Window) -> tuple[State, Demand]:
    """Let the regulator work for the truck of the step, until the drum leaves its speeds."""
    truck, before = params.trucks[state.number], state.regulator
    if before is None:
        before = params.regulator.seed(truck, window.motor_speed, window.drum_speed)
    pushed = step.force * params.drum_radius / params.gear_ratio
    seen = replace(window, shaft_torque=window.shaft_torque + pushed)
    inner, demand = params.regulator.update(truck, before, seen)
    time = state.time + window.duration
    after = replace(state, time=time, motor_speed=demand.speed, regulator=inner)
    rim = window.drum_speed * params.drum_radius
    lasts = step.slowest < rim < step.fastest and time < step.longest
    return after if lasts else _next_step(after), demand


def follow(params: Params, state: State, demand: float, setpoint: float) -> State:
    """State that continues from the setpoint that the limits passed; demand, setpoint [rad/s]."""
    after = replace(state, motor_speed=setpoint)
    if state.regulator is None:
        return after
    truck = params.trucks[state.number]
    inner = params.regulator.follow(truck, state.regulator, demand, setpoint)
    return replace(after, regulator=inner)
