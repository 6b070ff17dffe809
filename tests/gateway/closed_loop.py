"""Gateway's tick and emulated PLC in one virtual time: no clock, no socket, everything in words."""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace

from gateway.configuration.config import Config
from gateway.cycle import cycle
from gateway.cycle.cycle import Observation, Output
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from plant_emulator import parameter_sets
from plant_emulator.emulator.plc.plc import Plc
from plant_emulator.emulator.plc.surroundings import Backlash, Switches, Truck
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.simulation.truck import Driver, Forklift, ReplayedTorque
from plant_emulator.solver import compiler
from register_maps import load
from register_maps.codec import decode_measurement, encode_measurement, encode_setpoint
from register_maps.signals import Measurement
from register_maps.timing import SCAN

PARAMETERS = parameter_sets.load("thesis_table_3_1")
Reading = Measurement | Reason
Disturbance = Callable[["ClosedLoop", Reading], Reading]


def undisturbed(_: "ClosedLoop", reading: Reading) -> Reading:
    return reading


@dataclass
class ClosedLoop:
    config: Config
    map_name: str = "bench_int16"
    shadow: bool = False
    disturb: Disturbance = undisturbed
    refused: Reason | None = None
    stop_requested: bool = False
    overruns: int = 0
    latency: float = 0.0
    observations: list[Observation] = field(default_factory=list)
    outputs: list[Output] = field(default_factory=list)
    drum_speed: list[float] = field(default_factory=list)
    wheel_torque: list[float] = field(default_factory=list)
    write_fault: Reason | None = None
    parameters: ParameterSet = PARAMETERS
    effects: dict[str, dict[str, float]] = field(default_factory=dict)
    driver: Callable[[Forklift], Driver] = ReplayedTorque

    def __post_init__(self) -> None:
        self.map = load(self.map_name)
        truck = Forklift(mass=self.config.truck.total_mass)
        half_gap = self.parameters.value("backlash_half_gap")
        self.plc = Plc(
            Bench(self.parameters, self.effects),
            self.map,
            backlash=Backlash(ratio=62.6, half_gap=half_gap),
            truck=Truck(lambda: self.driver(truck), 0.645),
        )
        self.switches = Switches()
        self.words: Sequence[int] | None = None
        self.state = cycle.initial(self.config, self.map)
        self.every = round(self.config.loop.period / SCAN)

    @property
    def now(self) -> float:
        return self.plc.scans * SCAN + 0.003

    @property
    def last(self) -> Output:
        return self.outputs[-1]

    def operate(self, *, remote: bool) -> None:
        self.switches = replace(self.switches, remote=remote)

    def run(self, duration: float) -> Output:
        for _ in range(round(duration / SCAN)):
            shown = self.plc.scan(self.words, self.switches)
            self.drum_speed.append(float(self.plc.samples.drum_speed[-1]))
            self.wheel_torque.append(self.plc.samples.wheel_torque)
            if self.plc.scans % self.every == 0:
                self.tick(decode_measurement(self.map, encode_measurement(self.map, shown)))
        return self.last

    def tick(self, measurement: Measurement) -> None:
        reading = self.disturb(self, measurement)
        failed = isinstance(reading, Reason)
        seen = Observation(
            now=self.now,
            measurement=None if failed else reading,
            fault=reading if failed else self.write_fault,
            shadow=self.shadow,
            stop_requested=self.stop_requested,
            overruns=self.overruns,
            latency=self.latency,
        )
        self.state, output = cycle.step(self.config, self.map, self.state, seen)
        self.observations.append(seen)
        self.outputs.append(output)
        unseen = self.write_fault if failed else None
        self.write_fault = unseen if output.setpoint is None else self.refused
        if output.setpoint is not None and self.refused is None:
            self.words = encode_setpoint(self.map, output.setpoint)

    def start(self) -> None:
        """Arm, and let the operator set remote: the truck sets off as soon as the PLC runs."""
        self.run(0.2)
        assert self.last.state is State.ARMED
        self.operate(remote=True)
        self.run(0.2)
        assert self.last.state is State.RUN, self.last

    def branch(self) -> "ClosedLoop":
        """A loop that goes on from here by itself, for one run up to where many tests begin."""
        bench = self.plc.bench
        same = (self.config, self.map, self.parameters, self.state.params, bench._kernel)
        past = (self.observations, self.outputs, self.drum_speed, self.wheel_torque)
        known = {id(one): one for one in same} | {id(one): list(one) for one in past}
        if compiler.ENABLED:  # a compiled kernel takes the array that a record stands in
            records = (bench._p, bench._stage)
            known |= {id(one): one.base.copy()[0] for one in records}  # type: ignore[attr-defined]
        return deepcopy(self, known)
