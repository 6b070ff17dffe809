"""A forklift on the drum and on the road: cycle, road load, driver, and the road as the target.

    m dv/dt = T_w / r_w - F_RL(v)                                   (thesis, eq. 4.1, 4.13)
    F_RL = m g (C_rr + C_rr,v |v| / r_d) sgn v                      (thesis, eq. 4.11, level road)

On the drum the wheel torque acts through r_d / r_w (eq. 4.5). The cycle is the one of programs 6
and 6L: 14 km/h, start at 2 s, brake at 22 s, 30 s, accelerations with linear flanks of 0.6 s; read
off the logged wheel torque of the independent bench. m is the translating mass alone: what spins
in the truck spins on the drum as it does on the road.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

GRAVITY = 9.81
KMH = 1.0 / 3.6


@dataclass(frozen=True, kw_only=True)
class Forklift:
    """A truck; masses [kg], radii [m], rolling resistance [1], [s/rad] on the drum's speed."""

    mass: float = 3640.0
    wheel_radius: float = 0.1715
    drum_radius: float = 0.645
    crr: float = 0.0117
    crr_v: float = 9.3882e-6

    def road_load(self, speed: float) -> float:
        """Rolling resistance against the motion [N]; 0 at rest. speed [m/s] (eq. 4.11)"""
        weight = self.mass * GRAVITY
        sign = float(np.sign(speed))
        return weight * (self.crr + self.crr_v * abs(speed) / self.drum_radius) * sign


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """A travel cycle: up to `speed` from `start`, down to rest from `brake` [m/s, s].

    up, down : time that a constant acceleration would take [s]; its flanks add `flank` [s]
    """

    speed: float = 14.0 * KMH
    start: float = 2.0
    up: float = 6.0
    brake: float = 22.0
    down: float = 3.8
    flank: float = 0.6
    duration: float = 30.0

    def acceleration(self, time: float) -> float:
        """Acceleration of the profile [m/s^2]."""
        up = self.speed / self.up * self._trapezoid(time - self.start, self.up)
        return up - self.speed / self.down * self._trapezoid(time - self.brake, self.down)

    def velocity(self, time: float) -> float:
        """Speed of the profile [m/s], the integral of its acceleration."""
        up = self._area(time - self.start, self.up) / self.up
        return self.speed * (up - self._area(time - self.brake, self.down) / self.down)

    def _trapezoid(self, tau: float, length: float) -> float:
        """1 between flanks of a trapezoid whose area is `length`."""
        return max(0.0, min(tau / self.flank, 1.0, (length + self.flank - tau) / self.flank))

    def _area(self, tau: float, length: float) -> float:
        """Integral of the trapezoid from 0 to tau [s]."""
        rising = min(max(tau, 0.0), self.flank)
        flat = min(max(tau - self.flank, 0.0), length - self.flank)
        falling = min(max(tau - length, 0.0), self.flank)
        return rising**2 / (2 * self.flank) + flat + falling - falling**2 / (2 * self.flank)


# Below this speed of the braking profile the truck's parking brake takes over [m/s].
PARKING_SPEED = 0.05
# Torque that the parking brake holds [N m at the wheel].
PARKING_TORQUE = 300.0
# A parked truck's wheel does not let the drum move before the start [N m at the wheel].
PARKED_TORQUE = 1e6


class Driver(Protocol):
    """Whoever asks the truck for torque, once per cycle of its controller."""

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """Drive torque and brake level at the wheel [N m], at that speed of its tread [m/s]."""
        ...


@dataclass(frozen=True)
class ReplayedTorque:
    """Driver "none": the torque that the cycle takes on the road, whatever the bench does."""

    truck: Forklift
    cycle: Cycle = field(default_factory=Cycle)

    def torques(self, time: float, speed: float) -> tuple[float, float]:  # noqa: ARG002 - protocol
        """m a(t) + F_RL(v(t)) at the wheel, then the parking brake."""
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
    """Driver "pi": the truck's speed controller holds the cycle's profile.

    gain [1/s] per truck mass, integral_time [s]; the torque is limited to what the drive has,
    while limited the integral waits.
    """

    truck: Forklift
    cycle: Cycle = field(default_factory=Cycle)
    gain: float = 2.0
    integral_time: float = 2.0
    torque_limit: float = 1200.0
    period: float = 0.01
    _integral: float = 0.0

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """PI on the speed error with the profile's acceleration fed forward."""
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
    """The driver of that name, "none" or "pi"."""
    kinds: dict[str, type[ReplayedTorque] | type[PiDriver]] = {
        "none": ReplayedTorque,
        "pi": PiDriver,
    }
    return kinds[name](truck, cycle or Cycle())


def road_step(truck: Forklift, speed: float, torque: float, brake: float, period: float) -> float:
    """Speed of the truck on the level road one period later [m/s].

    torque, brake : at the wheel [N m]; rolling resistance and brake stop it and hold it at rest.
    """
    drive = torque / truck.wheel_radius
    hold = truck.road_load(max(abs(speed), 1e-9)) + brake / truck.wheel_radius
    if speed == 0.0 and abs(drive) <= hold:
        return 0.0
    sign = float(np.sign(speed)) or float(np.sign(drive))
    new = speed + period * (drive - sign * hold) / truck.mass
    return 0.0 if new * sign < 0.0 else new


def road_speed(truck: Forklift, time: Array, wheel_torque: Array) -> Array:
    """The target: speed of the same truck on the road under a logged wheel torque [m/s].

    wheel_torque : in force during the interval that ends at its sample [N m], shape (n,). A
    negative torque on the standing truck is its brake's reaction, which does not drive it
    backwards.
    """
    speed = np.zeros(len(time))
    for k in range(1, len(time)):
        period = time[k] - time[k - 1]
        drive, brake = max(wheel_torque[k], 0.0), max(-wheel_torque[k], 0.0)
        speed[k] = road_step(truck, speed[k - 1], drive, brake, period)
    return speed


def drive_on_road(driver: Driver, truck: Forklift, time: Array) -> tuple[Array, Array]:
    """The same driver with the same truck on the road: speed [m/s] and drive torque [N m]."""
    speed, torque = np.zeros(len(time)), np.zeros(len(time))
    for k in range(1, len(time)):
        torque[k], brake = driver.torques(float(time[k - 1]), float(speed[k - 1]))
        speed[k] = road_step(truck, speed[k - 1], torque[k], brake, time[k] - time[k - 1])
    return speed, torque
