"""Energy of a truck over a travel cycle, from legs that it drove on the bench (pure).

A cycle moves a payload over its legs. With the work W+ that drives the truck at its wheel and the
work W- that brakes it

    E = sum of n (W+ / eta - r W-) + sum of n E_aux,   energy an hour = E * cycles an hour

eta is the efficiency from battery to wheel, r the share of the braking work that returns into the
battery. The bench measures W+ and W- only; all else is the user's. VDI 2198, EN 16796 and ISO 23308
define such cycles; their tables were not read.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from gateway.physics.window import Window

HOUR: Final = 3600.0
KWH: Final = 3.6e6
"""[J]"""
FORWARD, REVERSE = "forward", "reverse"


@dataclass(frozen=True, kw_only=True)
class Leg:
    """A run on the bench.

    name : of its recording; mass : of truck and load in it [kg]; count : in a cycle
    duration [s], distance [m]; driving, braking : work at the wheel [J]
    """

    name: str
    mass: float
    count: int
    direction: str
    duration: float
    distance: float
    driving: float
    braking: float


@dataclass(frozen=True, kw_only=True)
class Auxiliary:
    """Energy that the bench does not show, lifting for instance; energy : each time [J]."""

    what: str
    energy: float
    count: int


@dataclass(frozen=True, kw_only=True)
class TravelCycle:
    """A travel cycle; efficiency, recuperation as shares; payload : moved in each cycle [kg]."""

    name: str
    payload: float
    cycles_per_hour: float
    efficiency: float
    recuperation: float
    legs: tuple[Leg, ...]
    auxiliaries: tuple[Auxiliary, ...]

    @property
    def travel(self) -> float:
        """Energy out of the battery for the legs of a cycle [J]."""
        return sum(
            one.count * (one.driving / self.efficiency - self.recuperation * one.braking)
            for one in self.legs
        )

    @property
    def auxiliary(self) -> float:
        """Energy out of the battery for all else in a cycle [J]."""
        return sum(one.count * one.energy for one in self.auxiliaries)

    @property
    def duration(self) -> float:
        """Duration of the legs of a cycle [s]."""
        return sum(one.count * one.duration for one in self.legs)

    @property
    def fits(self) -> bool:
        """Whether so many cycles fit into an hour."""
        return self.duration * self.cycles_per_hour <= HOUR

    @property
    def power(self) -> float:
        """Energy an hour [kWh/h]."""
        return (self.travel + self.auxiliary) * self.cycles_per_hour / KWH

    @property
    def throughput(self) -> float:
        """Payload an hour [t/h]."""
        return 1e-3 * self.payload * self.cycles_per_hour

    @property
    def yielded(self) -> float:
        """Payload for an energy [t/kWh]."""
        return self.throughput / self.power

    def to_json(self) -> dict[str, Any]:
        """Return the cycle as the document travel-cycle/1."""
        return {
            "schema": "travel-cycle/1",
            "name": self.name,
            "kwh_per_hour": self.power,
            "t_per_hour": self.throughput,
            "t_per_kwh": self.yielded,
            "travel_joule": self.travel,
            "auxiliary_joule": self.auxiliary,
            "travel_s": self.duration,
            "cycles_per_hour": self.cycles_per_hour,
            "fits_into_the_hour": self.fits,
            "legs": [dict(vars(one)) for one in self.legs],
        }

    def __str__(self) -> str:
        rows = [
            f"{one.name:32s} {one.count:3d} x {one.mass:6.0f} kg {one.distance:8.1f} m "
            f"{one.duration:7.1f} s  driving {one.driving / 1e3:8.2f} kJ  "
            f"braking {one.braking / 1e3:8.2f} kJ{_direction_note(one)}"
            for one in self.legs
        ]
        room = HOUR / self.cycles_per_hour
        late = "" if self.fits else ": more than there is"
        parts = f"travel {self.travel / 1e3:.2f} kJ, auxiliary {self.auxiliary / 1e3:.2f} kJ"
        answer = f"{self.power:.3f} kWh/h  {self.throughput:.2f} t/h  {self.yielded:.2f} t/kWh"
        return "\n".join(
            (
                self.name,
                *rows,
                f"{parts} a cycle",
                f"legs take {self.duration:.2f} s of {room:.2f} s a cycle{late}",
                answer,
                "no compliance: the tables of VDI 2198, EN 16796 and ISO 23308 were not read",
            )
        )


def _direction_note(leg: Leg) -> str:
    """Note on a leg in reverse: the bench turns forward only."""
    return "  in reverse, driven forward on the bench" if leg.direction == REVERSE else ""


def work(windows: Iterable[tuple[Window, float]], drum_radius: float) -> dict[str, float]:
    """Entries of a leg: duration [s], distance [m], driving and braking work [J].

    windows : of the run, each with the torque of the truck on the drum [N m]; drum_radius [m]
    """
    found = dict.fromkeys(("duration", "distance", "driving", "braking"), 0.0)
    for window, torque in windows:
        angle = (window.drum_speed - 0.5 * window.drum_speed_change) * window.duration
        found["duration"] += window.duration
        found["distance"] += drum_radius * angle
        found["driving"] += max(torque * angle, 0.0)
        found["braking"] += max(-torque * angle, 0.0)
    return found
