"""The surroundings of the PLC's program: the bench, the truck on it and the operator's switches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import Protocol

from plant_emulator.simulation.running_bench import BenchSamples
from plant_emulator.simulation.truck import PARKING_TORQUE
from register_maps.signals import Interlock, PlcState

CLOSED = reduce(or_, Interlock)
PARKING_DRUM_SPEED = 0.05  # [rad/s]


class SteppedBench(Protocol):
    """A bench that can be simulated in steps of 1 ms."""

    @property
    def unsettled(self) -> int:
        """Number of steps so far whose equations were not solved."""

    def advance(
        self, references: Sequence[float], *, wheel_torque: float = 0.0, brake_torque: float = 0.0
    ) -> BenchSamples:
        """Simulate one step per reference.

        references : of the motor speed, one per step of 1 ms [rad/s]
        wheel_torque, brake_torque : at the truck's wheel [N m]
        """

    def limit_current(self, limit: float) -> None:
        """Set the largest armature current that the drive may ask for [A]."""


class Driver(Protocol):
    """The driver of the truck on the drum."""

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """Drive and brake torque at the wheel [N m].

        time : since the driver set off [s]; speed : of the tread [m/s]
        """


class Truck:
    """A truck on the drum. A new driver sets off when the bench enters road-load.

    Outside road-load and speed mode the truck has no driver and parks when the drum stands.
    Otherwise the frictionless drum would float through its backlash.
    """

    def __init__(self, new_driver: Callable[[], Driver], drum_radius: float) -> None:
        self._new_driver, self._drum_radius = new_driver, drum_radius
        self._driver: Driver | None = None
        self._since = 0.0
        self._parks = True

    def follow(self, state: PlcState, time: float) -> None:
        """Follow the PLC's new state at PLC time `time` [s]."""
        self._driver = self._new_driver() if state is PlcState.ROAD_LOAD else None
        self._since = time
        self._parks = state not in (PlcState.ROAD_LOAD, PlcState.SPEED)

    def torques(self, time: float, drum_speed: float) -> tuple[float, float]:
        """Drive and brake torque at the truck's wheel [N m], at PLC time `time` [s]."""
        if self._driver is not None:
            return self._driver.torques(time - self._since, self._drum_radius * drum_speed)
        stands = self._parks and abs(drum_speed) < PARKING_DRUM_SPEED
        return 0.0, PARKING_TORQUE if stands else 0.0


@dataclass(frozen=True, kw_only=True)
class Switches:
    """The operator's remote switch and the interlock chain."""

    remote: bool = False
    interlock: Interlock = CLOSED


@dataclass(frozen=True, kw_only=True)
class Backlash:
    """The backlash between gear and drum, for the PLC's gap bit.

    ratio : gear ratio [1]; half_gap : half of the backlash width at the gear output [rad]
    start : backlash gap position at the start, 0 in the middle [rad]
    """

    ratio: float
    half_gap: float
    start: float = 0.0

    def twist(self, motor_angle: float, drum_angle: float) -> float:
        """Angle of the gear output minus that of the drum, from the middle of the gap [rad]."""
        return self.start + motor_angle / self.ratio - drum_angle
