"""Tick of the gateway and emulated PLC in one virtual time, both talking in words of the map."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.arrays import Array
from gateway.configuration.config import Config
from gateway.cycle import cycle
from gateway.cycle.cycle import Observation
from gateway.cycle.supervisor import State
from gateway.errors import GatewayError
from plant_emulator.emulator.plc.plc import Plc
from plant_emulator.emulator.plc.surroundings import Backlash, Switches, Truck
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.simulation.truck import Driver
from register_maps.codec import decode_measurement, encode_measurement, encode_setpoint
from register_maps.register_map import RegisterMap
from register_maps.signals import PlcState
from register_maps.timing import SCAN

READING: Final = 0.003
"""[s] Time from a scan of the PLC to the tick that reads it."""
ARMING: Final = 0.5
"""[s] Time for the gateway to arm, and again to run."""


@dataclass(frozen=True, kw_only=True)
class Twin:
    """A bench with its gateway: what the gateway knows, what the bench is, how they talk."""

    config: Config
    parameters: ParameterSet
    map: RegisterMap


@dataclass(frozen=True, kw_only=True)
class TwinRun:
    """Scans of a run since the truck set off, in SI, shape (n,) each.

    wheel_torque : of the truck, its brake's reaction included, acting up to its sample [N m]
    """

    time: Array
    drum_speed: Array
    wheel_torque: Array


def run(twin: Twin, driver: Callable[[], Driver], duration: float) -> TwinRun:
    """Let a truck drive on the twin for a duration [s]. Raises GatewayError where the run ends."""
    loop = _Loop(twin, driver)
    loop.scan(ARMING)
    loop.switches = Switches(remote=True)
    loop.scan(ARMING, until=PlcState.ROAD_LOAD)
    loop.drum_speed.clear()
    loop.wheel_torque.clear()
    loop.scan(duration)
    if loop.state.supervisor.state is not State.RUN:
        reason = loop.state.supervisor.reason
        why = "nothing" if reason is None else reason.text
        raise GatewayError(f"the gateway of the digital twin ended its run: {why}")
    count = len(loop.drum_speed)
    return TwinRun(
        time=SCAN * np.arange(count, dtype=np.float64),
        drum_speed=np.array(loop.drum_speed),
        wheel_torque=np.array(loop.wheel_torque),
    )


class _Loop:
    """State of the closed loop."""

    def __init__(self, twin: Twin, driver: Callable[[], Driver]) -> None:
        known, p = twin.map, twin.parameters
        backlash = Backlash(ratio=p.value("gear_ratio"), half_gap=p.value("backlash_half_gap"))
        truck = Truck(driver, p.value("drum_radius"))
        self.plc = Plc(Bench(p, truck=True), known, backlash=backlash, truck=truck)
        self.switches = Switches()
        self.state = cycle.initial(twin.config, known)
        self.drum_speed: list[float] = []
        self.wheel_torque: list[float] = []
        self._twin, self._map = twin, known
        self._every = max(1, round(twin.config.loop.period / SCAN))
        self._words: Sequence[int] | None = None

    def scan(self, duration: float, until: PlcState | None = None) -> None:
        """Scan for a duration [s], or until the PLC comes to a state."""
        for _ in range(round(duration / SCAN)):
            shown = self.plc.scan(self._words, self.switches)
            self.drum_speed.append(float(self.plc.samples.drum_speed[-1]))
            self.wheel_torque.append(self.plc.samples.wheel_torque)
            if self.plc.scans % self._every == 0:
                self._tick(encode_measurement(self._map, shown))
            if until is not None and self.plc.state is until:
                return

    def _tick(self, words: Sequence[int]) -> None:
        seen = Observation(
            now=self.plc.scans * SCAN + READING, measurement=decode_measurement(self._map, words)
        )
        self.state, output = cycle.step(self._twin.config, self._map, self.state, seen)
        if output.setpoint is not None:
            self._words = encode_setpoint(self._map, output.setpoint)
