"""The emulator without its clock: bench, PLC, faults and Modbus server.

`build` makes an emulator from the options of the command line. `Emulator.scan` runs one scan. The
caller decides when: `scan_timer.py` in real time, `control_channel.py` on request.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from plant_emulator import effects, logs
from plant_emulator.emulator.plc import faults
from plant_emulator.emulator.plc.plc import STEPS, Plc
from plant_emulator.emulator.plc.surroundings import Backlash, Switches, Truck
from plant_emulator.emulator.server import PlcServer
from plant_emulator.parameter_sets import with_effects
from plant_emulator.signals.log import Log
from plant_emulator.simulation import truck
from plant_emulator.simulation.running_bench import Bench
from register_maps import load
from register_maps.codec import CodecError, encode_measurement
from register_maps.register_map import Register, RegisterMap
from register_maps.signals import Measurement

LOGGED = (
    "time",
    "speed_reference",
    "motor_speed",
    "drum_speed",
    "armature_current",
    "shaft_torque",
    "wheel_torque",
    "armature_voltage",
    "shell_temperature",
)

# Seed of the noise of declared sensors: every serving of a set shows the same noise.
NOISE_SEED = 0


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of an emulator, named like those of the command line.

    map : name of the register map
    speed : emulated seconds per second; None: the emulator scans only on request
    truck_mass : mass of the truck on the drum [kg]; None: no truck
    remote_after : PLC time at which the remote switch turns on [s]
    log : file that the log is written to at the end
    duration : PLC time at which the emulator stops [s]
    """

    host: str = "127.0.0.1"
    port: int = 5020
    map: str = "bench_int16"
    speed: float | None = 1.0
    parameters: str = "thesis_table_3_1"
    effects: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()
    truck_mass: float | None = 3640.0
    driver: str = "pi"
    remote: bool = False
    remote_after: float | None = None
    log: Path | None = None
    duration: float | None = None
    keeps_log: bool = False


class Emulator:
    """A PLC with its server. `switches` and `faults` may be replaced at any moment.

    on_faults_changed : called with the names of the active faults when these change
    """

    on_faults_changed: Callable[[frozenset[str]], None] | None = None

    def __init__(self, plc: Plc, server: PlcServer, *, keeps_log: bool = False) -> None:
        self.plc, self.server = plc, server
        self.switches = Switches()
        self.faults: tuple[faults.Fault, ...] = ()
        self.remote_after: float | None = None
        self._active: frozenset[str] = frozenset()
        self._previous = server.image
        self._scan_time_max = 0.0
        self._rows: list[tuple[float, ...]] | None = [] if keeps_log else None

    def scan(self) -> None:
        """Run one scan of the PLC and publish its measurement."""
        begin = time.perf_counter()
        if self.remote_after is not None and self.plc.time >= self.remote_after:
            self.remote_after = None
            self.switches = replace(self.switches, remote=True)
        measurement = self.plc.scan(self.server.command, self.switches, self._scan_time_max)
        self._publish(measurement)
        if self._rows is not None:
            self._rows.append(self._row(measurement))
        self._scan_time_max = max(self._scan_time_max, time.perf_counter() - begin)

    def _publish(self, measurement: Measurement) -> None:
        """Put the measurement into the server's image, after the active faults changed it."""
        register_map = self.server.register_map
        fresh = encode(register_map, measurement)
        names = faults.active(self.faults, self.plc.time)
        shown = self.server.image
        self.server.image = (
            faults.image(names, register_map, fresh, self._previous, shown) if names else fresh
        )
        self._previous = fresh
        if names != self._active:
            if faults.RESTART in names - self._active:
                self.plc.restart()
                self.server.command = None
            self._active = names
            if self.on_faults_changed is not None:
                self.on_faults_changed(names)

    def _row(self, measurement: Measurement) -> tuple[float, ...]:
        """One row of the log, in the order of LOGGED.

        With a truck the reference is a staircase: its mean over the next scan. Without a truck the
        reference is linear between the rows: its value at this time.
        """
        plc = self.plc
        reference = sum(plc.path) / STEPS if plc.truck else plc.reference
        return (
            plc.time,
            reference,
            measurement.motor_speed,
            measurement.drum_speed,
            float(plc.samples.armature_current[-1]),
            measurement.shaft_torque,
            plc.samples.wheel_torque,
            float(plc.samples.armature_voltage[-1]),
            plc.samples.shell_temperature,
        )

    def log(self) -> Log:
        """The log so far, one sample per scan."""
        rows = np.array(self._rows or np.zeros((0, len(LOGGED))))
        signals = {name: rows[:, k] for k, name in enumerate(LOGGED)}
        if self.plc.truck is None:
            del signals["wheel_torque"]
        return Log(signals.pop("time"), signals, "emulator")

    def write_log(self, path: Path) -> None:
        """Write the log to a file, in the format that the file's name tells."""
        logs.write(self.log(), path)


def encode(register_map: RegisterMap, measurement: Measurement) -> tuple[int, ...]:
    """Words of the measurement block, even if a value exceeds its register.

    A PLC does not stop because a value is too large. The value is then shown as not available,
    because the end of the range would look like a measurement. A register without such a mark stays
    at the end of its range, like the PLC's own conversion.
    """
    try:
        return encode_measurement(register_map, measurement)
    except CodecError:
        fitting: dict[str, Any] = {
            register.signal: _fit(register, value)
            for register in register_map.registers
            if isinstance(value := getattr(measurement, register.signal, None), float)
        }
        return encode_measurement(register_map, replace(measurement, **fitting))


def _fit(register: Register, value: float) -> float | None:
    """The value if the register can hold it, else None (not available) or the end of its range."""
    raw = (register.si_unit.from_si(value) - register.offset) / register.scale
    if register.wraps or register.raw.low - 0.5 < raw < register.raw.high + 0.5:
        return value
    if register.not_available is not None:
        return None
    end = register.raw.high if raw > 0.0 else register.raw.low
    return register.si_unit.to_si(end * register.scale + register.offset)


def build(options: Options) -> Emulator:
    """Build an emulator at rest.

    Raises MapError, FaultError or ParameterError if the options name something that does not exist.
    """
    register_map = load(options.map)
    active_faults = tuple(faults.parse(text) for text in options.faults)
    parameters = with_effects.load(options.parameters)
    chosen = effects.parse(options.effects)
    # The first call compiles the bench, which must not delay the first scan.
    Bench(parameters, chosen).advance([0.0] * STEPS)
    plc = Plc(
        Bench(parameters, chosen, truck=options.truck_mass is not None, seed=NOISE_SEED),
        register_map,
        backlash=Backlash(
            ratio=parameters.value("gear_ratio"),
            half_gap=parameters.value("backlash_half_gap"),
        ),
        truck=_truck(options, parameters.value("drum_radius"), parameters.value("wheel_radius")),
    )
    server = PlcServer(register_map, options.host, options.port)
    emulator = Emulator(plc, server, keeps_log=options.keeps_log or options.log is not None)
    emulator.switches = Switches(remote=options.remote)
    emulator.faults = active_faults
    emulator.remote_after = options.remote_after
    return emulator


def _truck(options: Options, drum_radius: float, wheel_radius: float) -> Truck | None:
    if options.truck_mass is None:
        return None
    forklift = truck.Forklift(
        mass=options.truck_mass, drum_radius=drum_radius, wheel_radius=wheel_radius
    )
    return Truck(lambda: truck.driver_of(options.driver, forklift), drum_radius)
