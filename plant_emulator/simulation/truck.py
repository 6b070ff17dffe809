"""A forklift on the drum and on the road: travel cycle, road load, driver, target speed.

    m dv/dt = T_w / r_w - F_RL(v)                                   (thesis, eq. 4.1, 4.13)
    F_RL = m g (C_rr + C_rr,v |v| / r_d) sgn v                      (thesis, eq. 4.11, level road)

On the drum the wheel torque acts through r_d / r_w (eq. 4.5). The travel cycle is that of programs
6 and 6L: 14 km/h, start at 2 s, brake at 22 s, end at 30 s. Its accelerations have linear flanks of
0.6 s. It is read off the logged wheel torque of the independent bench. m is the translating mass
alone, because the truck's rotating parts turn on the drum as they do on the road.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from plant_emulator.model.dimensions import DRUM_RADIUS, WHEEL_RADIUS
from register_maps.units import KMH

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

GRAVITY = 9.81


@dataclass(frozen=True, kw_only=True)
class Forklift:
    """A truck: mass [kg], radii [m], rolling resistance crr [1] and crr_v [s/rad of the drum]."""

    mass: float = 3640.0
    wheel_radius: float = WHEEL_RADIUS
    drum_radius: float = DRUM_RADIUS
    crr: float = 0.0117
    crr_v: float = 9.3882e-6

    def road_load(self, speed: float) -> float:
        """Rolling resistance against the motion [N], 0 at rest (thesis, eq. 4.11); speed [m/s]."""
        weight = self.mass * GRAVITY
        sign = float(np.sign(speed))
        return weight * (self.crr + self.crr_v * abs(speed) / self.drum_radius) * sign


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """A travel cycle: it accelerates to `speed` [m/s] at `start` and to rest at `brake` [s].

    up, down : times that constant accelerations would take [s]; flank : time of a linear flank,
        which adds to them [s]; duration : of the cycle [s]
    """

    speed: float = 14.0 * KMH
    start: float = 2.0
    up: float = 6.0
    brake: float = 22.0
    down: float = 3.8
    flank: float = 0.6
    duration: float = 30.0

    def acceleration(self, time: float) -> float:
        """Acceleration of the cycle at a time [m/s^2]; time [s]."""
        up = self.speed / self.up * self._trapezoid(time - self.start, self.up)
        return up - self.speed / self.down * self._trapezoid(time - self.brake, self.down)

    def velocity(self, time: float) -> float:
        """Speed of the cycle at a time [m/s], the integral of its acceleration; time [s]."""
        up = self._area(time - self.start, self.up) / self.up
        return self.speed * (up - self._area(time - self.brake, self.down) / self.down)

    def _trapezoid(self, tau: float, length: float) -> float:
        """Height of a trapezoid at the time tau: 1 between its flanks, its area is `length` [s]."""
        return max(0.0, min(tau / self.flank, 1.0, (length + self.flank - tau) / self.flank))

    def _area(self, tau: float, length: float) -> float:
        """Integral of the trapezoid from 0 to tau [s]."""
        rising = min(max(tau, 0.0), self.flank)
        flat = min(max(tau - self.flank, 0.0), length - self.flank)
        falling = min(max(tau - length, 0.0), self.flank)
        return rising**2 / (2 * self.flank) + flat + falling - falling**2 / (2 * self.flank)


# Speed of the cycle below which the parking brake takes over while braking [m/s].
PARKING_SPEED = 0.05
# Largest torque that the parking brake holds [N m at the wheel].
PARKING_TORQUE = 300.0
# Torque that holds the drum under the parked truck before the start [N m at the wheel].
PARKED_TORQUE = 1e6


class Driver(Protocol):
    """A driver, who sets the truck's torque once in each cycle of its controller."""

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """Drive torque and brake torque at the wheel [N m]; time [s], speed of its tread [m/s]."""
        ...


@dataclass(frozen=True)
class ReplayedTorque:
    """Driver "none": replays the torque of the cycle on the road, whatever the bench does."""

    truck: Forklift
    cycle: Cycle = field(default_factory=Cycle)

    def torques(self, time: float, speed: float) -> tuple[float, float]:  # noqa: ARG002 - protocol
        """Torques at the wheel [N m]: m a(t) + F_RL(v(t)) times r_w, then the parking brake."""
        cycle, truck = self.cycle, self.truck
        if time <= cycle.start:
            return 0.0, PARKED_TORQUE
        profile = cycle.velocity(time)
        if time > cycle.brake and profile < PARKING_SPEED:
            return 0.0, PARKING_TORQUE
        rolling = truck.road_load(max(profile, 1e-9))
        return (truck.mass * cycle.acceleration(time) + rolling) * truck.wheel_radius, 0.0


@dataclass
class PiDriver:
    """Driver "pi": the truck's speed controller follows the speed of the cycle.

    gain : per mass of the truck [1/s]; integral_time, period : [s]
    torque_limit : largest drive torque [N m at the wheel]; at the limit the integral stops
    """

    truck: Forklift
    cycle: Cycle = field(default_factory=Cycle)
    gain: float = 2.0
    integral_time: float = 2.0
    torque_limit: float = 1200.0
    period: float = 0.01
    _integral: float = 0.0

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """Torques at the wheel [N m]: PI on the speed error, acceleration fed forward."""
        cycle, truck = self.cycle, self.truck
        if time <= cycle.start:
            return 0.0, PARKED_TORQUE
        profile = cycle.velocity(time)
        if time > cycle.brake and profile < PARKING_SPEED:
            return 0.0, PARKING_TORQUE
        error = profile - speed
        integral = self._integral + error * self.period
        wanted = cycle.acceleration(time) + self.gain * (error + integral / self.integral_time)
        torque = truck.mass * wanted * truck.wheel_radius
        limited = max(-self.torque_limit, min(self.torque_limit, torque))
        if limited == torque:
            self._integral = integral
        return limited, 0.0


def driver_of(name: str, truck: Forklift, cycle: Cycle | None = None) -> Driver:
    """Make the driver of that name, "none" or "pi"; cycle None: that of programs 6 and 6L."""
    kinds: dict[str, type[ReplayedTorque] | type[PiDriver]] = {
        "none": ReplayedTorque,
        "pi": PiDriver,
    }
    return kinds[name](truck, cycle or Cycle())


def road_step(truck: Forklift, speed: float, torque: float, brake: float, period: float) -> float:
    """Speed of the truck on the level road one period later [m/s].

    torque, brake : at the wheel [N m]; rolling resistance and brake stop the truck and hold it.
    speed [m/s], period [s]
    """
    drive = torque / truck.wheel_radius
    hold = truck.road_load(max(abs(speed), 1e-9)) + brake / truck.wheel_radius
    if speed == 0.0 and abs(drive) <= hold:
        return 0.0
    sign = float(np.sign(speed)) or float(np.sign(drive))
    new = speed + period * (drive - sign * hold) / truck.mass
    return 0.0 if new * sign < 0.0 else new


def road_speed(truck: Forklift, time: Array, wheel_torque: Array) -> Array:
    """Target speed: that of the truck on the level road under a logged wheel torque [m/s].

    time : of the samples [s]; wheel_torque : torque during the interval before each sample [N m].
    Both have shape (n,), as the result. A negative torque on the standing truck is the reaction of
    its brake, which does not drive it backwards.
    """
    speed = np.zeros(len(time))
    for k in range(1, len(time)):
        period = time[k] - time[k - 1]
        drive, brake = max(wheel_torque[k], 0.0), max(-wheel_torque[k], 0.0)
        speed[k] = road_step(truck, speed[k - 1], drive, brake, period)
    return speed


def drive_on_road(driver: Driver, truck: Forklift, time: Array) -> tuple[Array, Array]:
    """Drive a truck on the road: speed [m/s] and drive torque [N m] at the times, shape (n,)."""
    speed, torque = np.zeros(len(time)), np.zeros(len(time))
    for k in range(1, len(time)):
        torque[k], brake = driver.torques(float(time[k - 1]), float(speed[k - 1]))
        speed[k] = road_step(truck, speed[k - 1], torque[k], brake, time[k] - time[k - 1])
    return speed, torque
