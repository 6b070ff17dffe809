"""What surrounds the PLC's program: the bench, the truck on it, the people at its switches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import Protocol

from plant_emulator.simulation.running_bench import BenchSamples
from register_maps.signals import Interlock, PlcState

CLOSED = reduce(or_, Interlock)
PARKING_SPEED = 0.05
PARKING_TORQUE = 300.0


class Bench(Protocol):
    """Anything that runs under speed references [rad/s], one for each sub-step of 1 ms."""

    @property
    def unsettled(self) -> int:
        """Steps so far whose equations were not solved."""

    def advance(
        self, references: Sequence[float], *, wheel_torque: float = 0.0, brake_torque: float = 0.0
    ) -> BenchSamples:
        """Run one sub-step an entry; torques [N m] at the truck's wheel."""

    def limit_current(self, limit: float) -> None:
        """Let the drive ask for no more than that armature current [A]."""


class Driver(Protocol):
    """Whoever drives the truck on the drum."""

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """Drive and brake torque at the wheel [N m]; time since he set off, tread speed [m/s]."""


class Truck:
    """A truck on the drum: a new driver sets off whenever the bench goes into road-load.

    When the bench is neither in road-load nor in speed mode nobody drives, and the truck is parked
    as soon as the drum stands: without that the frictionless drum would float through its gap.
    """

    def __init__(self, new_driver: Callable[[], Driver], drum_radius: float) -> None:
        self._new_driver, self._drum_radius = new_driver, drum_radius
        self._driver: Driver | None = None
        self._since = 0.0
        self._parks = True

    def follow(self, state: PlcState, time: float) -> None:
        """Do what goes with the PLC's new state; time: now [s]."""
        self._driver = self._new_driver() if state is PlcState.ROAD_LOAD else None
        self._since = time
        self._parks = state not in (PlcState.ROAD_LOAD, PlcState.SPEED)

    def torques(self, time: float, drum_speed: float) -> tuple[float, float]:
        """Drive and brake torque at its wheel [N m]."""
        if self._driver is not None:
            return self._driver.torques(time - self._since, self._drum_radius * drum_speed)
        stands = self._parks and abs(drum_speed) < PARKING_SPEED
        return 0.0, PARKING_TORQUE if stands else 0.0


@dataclass(frozen=True, kw_only=True)
class Switches:
    """What people do at the bench: the operator's remote switch, and the interlock chain."""

    remote: bool = False
    interlock: Interlock = CLOSED


@dataclass(frozen=True, kw_only=True)
class Backlash:
    """The gap between gear and drum as the PLC knows it.

    ratio : of the gear; half_gap, start : at the gear output, start 0 = middle of the gap [rad]
    """

    ratio: float
    half_gap: float
    start: float = 0.0

    def twist(self, motor_angle: float, drum_angle: float) -> float:
        """Angle of the gear output before the drum, from the middle of the gap [rad]."""
        return self.start + motor_angle / self.ratio - drum_angle
