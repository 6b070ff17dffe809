"""What an effect of an axis is: columns of a regression, or another force.

An effect enters linearly by its sizes, given its shapes. A shape is a nonlinear constant, such as a
time or a speed; a grid finds it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.axis.motion.run import Base, Motion
    from plant_emulator.signals.log import Array

    Shapes = Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Scale:
    """The magnitudes of an axis and its runs [SI].

    force : deviation of the force; speed : highest; acceleration : rms
    middle, travel : middle and half of the travel
    period : between two samples of the slowest log; length : of the longest run
    rotary : whether the axis turns
    width : speed over which the Coulomb friction changes its sign
    """

    force: float
    speed: float
    acceleration: float
    middle: float
    travel: float
    period: float
    length: float
    rotary: bool
    width: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Context:
    """What a law may know: the motion of a run, the nominal parameters so far, and the scale."""

    motion: Motion
    base: Base
    scale: Scale


@dataclass(frozen=True, kw_only=True)
class Size:
    """A linear constant.

    unit : of a linear and of a rotary axis; lowest, highest : that physics allows
    """

    name: str
    unit: tuple[str, str]
    lowest: float = float("-inf")
    highest: float = float("inf")


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A nonlinear constant between two bounds, in units of the scale's field `of` (or 1).

    widths : that it is at least, of the Coulomb friction
    """

    name: str
    unit: tuple[str, str]
    lower: float
    upper: float
    of: str = ""
    widths: float = 0.0

    def bounds(self, scale: Scale) -> tuple[float, float]:
        """Bounds [unit]."""
        of = float(getattr(scale, self.of)) if self.of else 1.0
        return max(self.lower * of, self.widths * scale.width), self.upper * of


@dataclass(frozen=True, kw_only=True)
class Effect:
    """An effect of an axis.

    columns : force per size at the nodes, one array a size; empty for an effect of the force
    refers : whether the columns depend on the nominal parameters, and so on the fit that they enter
    replaced : the force that acts, from a function of time to another one, for these shapes
    needs : what a log must have to show the effect
    applies : whether the runs have the channels that the law needs
    """

    name: str
    title: str
    subsystem: str
    equation: str
    needs: str = ""
    sizes: tuple[Size, ...] = ()
    shapes: tuple[Shape, ...] = ()
    columns: Callable[[Context, Shapes], Sequence[Array]] | None = None
    refers: bool = False
    replaced: Callable[[Callable[[Array], Array], Array, Shapes], Array] | None = None
    applies: Callable[[Motion, Scale], bool] = lambda _motion, _scale: True

    @property
    def constants(self) -> list[Size | Shape]:
        """Sizes, then shapes."""
        return [*self.sizes, *self.shapes]

    def has_room(self, scale: Scale) -> bool:
        """Whether the bounds of every shape leave room between them."""
        return all(low < high for low, high in (s.bounds(scale) for s in self.shapes))

    def to_json(self) -> dict[str, Any]:
        """The effect as an entry of the document `effects/1`; units of a linear, a rotary axis."""
        return {
            "effect": self.name,
            "subsystem": self.subsystem,
            "description": f"{self.title}: {self.equation}",
            "needs": self.needs or None,
            "parameters": [
                {"name": one.name, "unit": one.unit[0], "unit_rotary": one.unit[1]}
                for one in self.constants
            ],
        }


FORCE, SPEED = ("N", "N m"), ("m/s", "rad/s")
TIME, NONE = ("s", "s"), ("1", "1")
TRAVEL, RATE = ("m", "rad"), ("m/s^2", "rad/s^2")
