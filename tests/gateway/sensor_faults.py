"""Faults of the sensors, as they change what the PLC reads from a moment on."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from gateway.configuration.config import Config
from plant_emulator.simulation.truck import Cycle, driver_of
from register_maps.signals import Measurement
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop
from tests.gateway.drifted_bench import Noisy


@dataclass
class TorqueFault:
    """The torque sensor shows `shown(torque, held)`; its mean and its integral follow.

    held : the torque of the last sound sample [N m]
    """

    shown: Callable[[float, float], float]
    _held: float | None = None
    _shift: float = 0.0
    _true_integral: float | None = None

    def __call__(self, reading: Measurement) -> Measurement:
        """Sample with the fault."""
        assert reading.shaft_torque_mean is not None
        assert reading.shaft_torque_integral is not None
        if self._held is None:
            self._held = reading.shaft_torque
            self._true_integral = reading.shaft_torque_integral - reading.shaft_torque_mean * SCAN
        mean = self.shown(reading.shaft_torque_mean, self._held)
        assert self._true_integral is not None
        self._shift += mean * SCAN - (reading.shaft_torque_integral - self._true_integral)
        self._true_integral = reading.shaft_torque_integral
        return replace(
            reading,
            shaft_torque=self.shown(reading.shaft_torque, self._held),
            shaft_torque_mean=mean,
            shaft_torque_integral=reading.shaft_torque_integral + self._shift,
        )


@dataclass
class SpeedFault:
    """One speed sensor shows a factor of its speed; None: its last sound sample."""

    signal: str
    factor: float | None
    _held: float | None = field(default=None)

    def __call__(self, reading: Measurement) -> Measurement:
        """Sample with the fault."""
        value = getattr(reading, self.signal)
        if self._held is None:
            self._held = value
        shown = self._held if self.factor is None else self.factor * value
        return replace(reading, **{self.signal: shown})


FAULTS: dict[str, Callable[[], Callable[[Measurement], Measurement]]] = {
    "torque dead": lambda: TorqueFault(lambda torque, held: 0.0),
    "torque held": lambda: TorqueFault(lambda torque, held: held),
    "torque inverted": lambda: TorqueFault(lambda torque, held: -torque),
    "torque x2": lambda: TorqueFault(lambda torque, held: 2.0 * torque),
    "torque +6 N m": lambda: TorqueFault(lambda torque, held: torque + 6.0),
    "torque -6 N m": lambda: TorqueFault(lambda torque, held: torque - 6.0),
    "motor speed 0": lambda: SpeedFault("motor_speed", 0.0),
    "motor speed x0.5": lambda: SpeedFault("motor_speed", 0.5),
    "drum speed frozen": lambda: SpeedFault("drum_speed", None),
    "drum speed x0.5": lambda: SpeedFault("drum_speed", 0.5),
}
"""A fault by its name; call it to begin the fault with the next sample."""


def driving(kmh: float, driver: str, *, seed: int | None = 7) -> ClosedLoop:
    """A loop at this speed; at standstill, 1 s before the truck sets off.

    seed : of the noise of the sensors; None: no noise
    """
    return _driven(kmh, driver, seed).branch()


@cache
def _driven(kmh: float, driver: str, seed: int | None) -> ClosedLoop:
    top = (kmh or 14.0) / 3.6
    up = top / 0.65
    cycle = Cycle(speed=top, up=up, brake=8.0 + up, down=top / 1.05, duration=60.0)
    config = Config().with_values({"plausibility.noisy_sensors": seed is not None})
    loop = ClosedLoop(config, driver=lambda truck: driver_of(driver, truck, cycle))
    if seed is not None:
        loop.disturb = Noisy(np.random.default_rng(seed))
    loop.start()
    loop.run(4.0 + up - 0.2 if kmh else 0.8)
    return loop
