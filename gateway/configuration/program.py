"""A program of the gateway: the steps that a run without a truck goes through (pure).

A configuration with a program makes the gateway go through these steps instead of the road load of
one truck. The commands that drive a program put it there, so that the recording tells what was
asked for, and a replay does it again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite
from typing import Any, Final

from gateway.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Profile:
    """A motor speed over time, linear between its points.

    times : since the begin of the step, increasing, from 0 [s]; speeds [rad/s]
    label : what the step is for, in every kind of step
    """

    times: tuple[float, ...]
    speeds: tuple[float, ...]
    label: str = ""

    @property
    def duration(self) -> float:
        """Duration of the step [s]."""
        return self.times[-1]


@dataclass(frozen=True, kw_only=True)
class Ramp:
    """A slope from the present motor speed to another one, which is then held.

    speed [rad/s]; rate : of the slope [rad/s^2]; hold : time for which the speed is held [s]
    """

    speed: float
    rate: float
    hold: float
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Emulation:
    """A truck that only the regulator knows, pushed by a constant force.

    mass [kg]; f0, f1, f2 : road load [N], [N s/m], [N s^2/m^2]; force : at the wheel [N]
    slowest, fastest : speeds of the drum's rim between which the step lasts [m/s]
    longest : time after which it ends in any case [s]
    """

    mass: float
    f0: float
    f1: float
    f2: float
    force: float
    slowest: float
    fastest: float
    longest: float
    label: str = ""


Step = Profile | Ramp | Emulation


@dataclass(frozen=True, kw_only=True)
class Program:
    """Steps in their order, and the name of the whole."""

    name: str
    steps: tuple[Step, ...]

    @property
    def duration(self) -> float:
        """Duration from standstill to the end [s], with the longest time of every emulation."""
        total, speed = 0.0, 0.0
        for step in self.steps:
            match step:
                case Profile():
                    total, speed = total + step.duration, step.speeds[-1]
                case Ramp():
                    total += abs(step.speed - speed) / step.rate + step.hold
                    speed = step.speed
                case Emulation():
                    total += step.longest
        return total


KINDS: Final[dict[str, type[Profile] | type[Ramp] | type[Emulation]]] = {
    "profile": Profile,
    "ramp": Ramp,
    "emulation": Emulation,
}


def document_of(program: Program) -> dict[str, Any]:
    """Document of a program, which `read_program` takes."""
    kinds = {kind: name for name, kind in KINDS.items()}
    return {
        "name": program.name,
        "steps": [{"kind": kinds[type(step)], **_plain(step)} for step in program.steps],
    }


def _plain(step: Step) -> dict[str, Any]:
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in vars(step).items()
    }


def read_program(table: object, place: str) -> Program:
    """Program in a table with name and steps, all in SI. Raises ConfigError."""
    if not isinstance(table, Mapping) or set(table) != {"name", "steps"}:
        wanted = "a table with name, steps"
        raise ConfigError("no program", place=place, value=table, expected=wanted)
    steps = table["steps"]
    if not isinstance(steps, list) or not steps:
        raise ConfigError("no steps", place=f"{place}.steps", value=steps, expected="a list")
    read = [_step(step, f"{place}.steps[{number}]") for number, step in enumerate(steps)]
    return Program(name=str(table["name"]), steps=tuple(read))


def _step(table: object, place: str) -> Step:
    kind = KINDS.get(str(table.get("kind"))) if isinstance(table, Mapping) else None
    if not isinstance(table, Mapping) or kind is None:
        expected = f"a table with kind = {', '.join(KINDS)}"
        raise ConfigError("no step", place=place, value=table, expected=expected)
    values = {name: value for name, value in table.items() if name not in ("kind", "label")}
    wanted = set(kind.__dataclass_fields__) - {"label"}
    if set(values) != wanted:
        expected = ", ".join(sorted(wanted))
        raise ConfigError("wrong keys", place=place, value=list(values), expected=expected)
    label = str(table.get("label", ""))
    if kind is Profile:
        return replace(_profile(values, place), label=label)
    numbers = {name: _number(value, f"{place}.{name}") for name, value in values.items()}
    return Ramp(**numbers, label=label) if kind is Ramp else Emulation(**numbers, label=label)


def _profile(values: Mapping[str, Any], place: str) -> Profile:
    times, speeds = (
        tuple(_number(one, f"{place}.{name}") for one in _list(values[name], f"{place}.{name}"))
        for name in ("times", "speeds")
    )
    rising = all(before < after for before, after in pairwise(times))
    if len(times) != len(speeds) or times[0] != 0.0 or not rising:
        raise ConfigError(
            "no speed over time",
            place=place,
            expected="increasing times from 0, and a speed for each",
        )
    return Profile(times=times, speeds=speeds)


def _list(value: object, place: str) -> Sequence[Any]:
    if not isinstance(value, list) or not value:
        raise ConfigError("no list", place=place, value=value, expected="a list of numbers")
    return value


def _number(value: object, place: str) -> float:
    usable = isinstance(value, int | float) and not isinstance(value, bool)
    if not isinstance(value, int | float) or not usable or not isfinite(value):
        raise ConfigError("bad value", place=place, value=value, expected="a finite number")
    return float(value)
