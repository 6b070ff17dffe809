"""What the learned regulator remembers of a repeated cycle, as a table of the configuration."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from math import isfinite
from typing import Any

from gateway.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """A crossing of the backlash, which comes again in each repeat of the cycle.

    time : at which the torque between gear and drum passes zero, from the truck's start on [s]
    direction : 1 where the gear has to come ahead of the drum, -1 where it falls behind
    delay : of the next planned crossing behind that time [s]
    best, cost : best delay so far [s], and the drum's squared error with it [rad^2/s]
    step : next change of the delay [s]
    """

    time: float
    direction: float
    delay: float
    best: float
    cost: float
    step: float


@dataclass(frozen=True, kw_only=True)
class Memory:
    """Memory of a cycle: duration from the truck's start to its stop [s], crossings in order."""

    duration: float = 0.0
    crossings: tuple[Crossing, ...] = ()

    @property
    def document(self) -> dict[str, Any]:
        """Table `learned` as a configuration file has it."""
        return {"duration": self.duration, "crossings": [asdict(one) for one in self.crossings]}

    @property
    def toml(self) -> str:
        """This memory as a file that `learned` names; an unseen cycle has no crossings."""
        lines = [
            "# What the learned regulator remembers of a cycle: times in s from the truck's start.",
            f"duration = {self.duration!r}",
            *([] if self.crossings else ["crossings = []"]),
        ]
        for one in self.crossings:
            values = (f"{name} = {value!r}" for name, value in asdict(one).items())
            lines += ["", "[[crossings]]", *values]
        return "\n".join(lines) + "\n"


NOTHING = Memory()
"""The memory of a regulator that has seen no repeat."""


def read_memory(table: object, place: str) -> Memory:
    """Memory in a table. Raises ConfigError, in which `place` names the table."""
    if not isinstance(table, Mapping) or table.keys() != {"duration", "crossings"}:
        raise ConfigError("no memory", place=place, value=table, expected="duration and crossings")
    if not isinstance(table["crossings"], list):
        raise ConfigError(
            "no crossings", place=place, value=table["crossings"], expected="a list of tables"
        )
    return Memory(
        duration=_number(table["duration"], f"{place}.duration"),
        crossings=tuple(_crossing(one, f"{place}.crossings") for one in table["crossings"]),
    )


def _crossing(table: object, place: str) -> Crossing:
    names = [one.name for one in fields(Crossing)]
    if not isinstance(table, Mapping) or table.keys() != set(names):
        raise ConfigError("no crossing", place=place, value=table, expected=", ".join(names))
    values = {name: _number(table[name], f"{place}.{name}") for name in names}
    if abs(values["direction"]) != 1.0:
        raise ConfigError(
            "bad value", place=f"{place}.direction", value=values["direction"], expected="1 or -1"
        )
    return Crossing(**values)


def _number(value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ConfigError("bad value", place=place, value=value, expected="a finite number")
    return float(value)
