"""Benches whose parameters have drifted, with noisy sensors and a truck that drives on and on.

A draw has the prior deviations of Table 3.1 (at most two) and 2 % on the constants of the motor.
Effects have up to their plausible size: friction of the motor, armature reaction, sensor errors.

    python -m tests.gateway.drifted_bench 101 120 6

drives each of these seeds for 6 minutes, and prints the largest sums of gateway.plausibility
over their alarm levels: motor, gear and drum. At last it tells the false alarms that these drives
let expect in 100 hours, by the tails of the largest sums of each minute. Everything is drawn anew
in each drive: the bench, the travels, the noise of the sensors and what the regulator makes of it.
"""

import sys
from dataclasses import dataclass, field, replace

import numpy as np

from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.plausibility.relations import shares
from plant_emulator import parameter_sets
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.truck import KMH, Cycle, Driver, Forklift, driver_of
from register_maps.signals import Measurement
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop

NOMINAL = parameter_sets.load("thesis_table_3_1")
GIVEN = {"flux_constant": 0.02, "motor_inertia": 0.02}
"""Relative deviation of constants from the data sheet."""
EFFECTS: dict[str, dict[str, tuple[float, float]]] = {
    "motor_friction": {"coulomb": (0.0, 0.5), "windage": (0.0, 4e-6)},
    "armature_reaction": {"share": (0.0, 0.1)},
    "torque_sensor_gain": {"error": (-0.03, 0.03)},
    "torque_sensor_offset": {"offset": (-0.5, 0.5)},
    "drum_speed_scale": {"error": (-0.01, 0.01)},
}


def drifted(seed: int) -> tuple[ParameterSet, dict[str, dict[str, float]]]:
    """Parameters and effects of one drifted bench."""
    random = np.random.default_rng(seed)
    values = {}
    for one in NOMINAL:
        deviation = one.std or GIVEN.get(one.name, 0.0) * one.value
        if deviation:
            values[one.name] = one.value + deviation * float(np.clip(random.normal(), -2.0, 2.0))
    effects = {
        name: {key: float(random.uniform(*ends)) for key, ends in parameters.items()}
        for name, parameters in EFFECTS.items()
    }
    return NOMINAL.with_values(values), effects


@dataclass
class Travels:
    """A driver who drives one travel cycle after the other, each to another speed."""

    truck: Forklift
    name: str
    random: np.random.Generator
    _driver: Driver | None = None
    _since: float = 0.0
    _cycle: Cycle = field(default_factory=Cycle)

    def torques(self, time: float, speed: float) -> tuple[float, float]:
        """Drive and brake torque at the wheel [N m]; time [s], speed of the tread [m/s]."""
        if self._driver is None or time - self._since > self._cycle.duration:
            self._since, self._cycle = time, self._next()
            self._driver = driver_of(self.name, self.truck, self._cycle)
        return self._driver.torques(time - self._since, speed)

    def _next(self) -> Cycle:
        top = float(self.random.uniform(4.0, 14.0)) * KMH
        up = top / float(self.random.uniform(0.3, 0.65))
        down = top / float(self.random.uniform(0.5, 1.05))
        cruise = float(self.random.uniform(2.0, 12.0))
        brake = 2.0 + up + cruise
        return Cycle(speed=top, up=up, brake=brake, down=down, duration=brake + down + 4.0)


@dataclass
class Noisy:
    """Disturbance that adds the noise of the sensors to every sample, integral and mean included.

    The fast task of the PLC takes ten torque samples a scan, so that its mean has less noise.
    """

    random: np.random.Generator
    _integral: float = 0.0

    def __call__(self, _: object, reading: Measurement) -> Measurement:
        """The sample with noise."""
        motor, drum, current, torque = self.random.standard_normal(4)
        mean = SENSORS["shaft_torque"][0] * self.random.standard_normal() / np.sqrt(10.0)
        self._integral += mean * SCAN
        assert reading.shaft_torque_mean is not None
        assert reading.shaft_torque_integral is not None
        assert reading.armature_current is not None
        return replace(
            reading,
            motor_speed=reading.motor_speed + SENSORS["motor_speed"][0] * motor,
            drum_speed=reading.drum_speed + SENSORS["drum_speed"][0] * drum,
            armature_current=reading.armature_current + SENSORS["armature_current"][0] * current,
            shaft_torque=reading.shaft_torque + SENSORS["shaft_torque"][0] * torque,
            shaft_torque_mean=reading.shaft_torque_mean + mean,
            shaft_torque_integral=reading.shaft_torque_integral + self._integral,
        )


def sound_drive(seed: int) -> ClosedLoop:
    """A running closed loop on a drifted bench; odd seeds have a driver who holds his speed."""
    parameters, effects = drifted(seed)
    random = np.random.default_rng(seed + 1000)
    loop = ClosedLoop(
        Config(),
        parameters=parameters,
        effects=effects,
        driver=lambda truck: Travels(truck, ("none", "pi")[seed % 2], random),
        disturb=Noisy(np.random.default_rng(seed + 2000)),
    )
    loop.start()
    return loop


def largest_shares(loop: ClosedLoop, duration: float) -> np.ndarray:
    """Drive on for a duration [s]; largest of the shares. Raises AssertionError for a trip."""
    largest = np.zeros(3)
    for _ in range(round(duration / SCAN)):
        loop.run(SCAN)
        assert loop.last.state is State.RUN, (loop.last.reason, loop.plc.time)
        largest = np.maximum(
            largest, shares(loop.state.watched.relations, loop.state.watched.sensors)
        )
        loop.observations.clear()
        loop.outputs[:-1] = []
    return largest


def minutes_of(seed: int, minutes: int) -> np.ndarray:
    """Largest shares in each minute of a drive, (minutes, 3). Raises AssertionError for a trip.

    The sum of the gear is the backlash, so that its largest share differs from bench to bench as
    the backlash does. It is told as on a bench with the widest backlash that is drawn.
    """
    loop = sound_drive(seed)
    shown = np.array([largest_shares(loop, 60.0) for _ in range(minutes)])
    gap = NOMINAL["backlash_half_gap"]
    assert gap.std is not None
    shown[:, 1] *= (gap.value + 2.0 * gap.std) / loop.parameters.value(gap.name)
    return shown


def expected_alarms(largest: np.ndarray) -> float:
    """False alarms in 100 hours by the exponential tails of the largest shares of minutes [1].

    largest : shape (minutes, relations), at least ten minutes
    A sum of noise passes a level h with a probability exp(-h / m); m is the mean excess over the
    90 % quantile u (peaks over threshold): 0.1 exp(-(1 - u) / m) in a minute.
    """
    limit = np.quantile(largest, 0.9, axis=0)
    tail = 0.0
    for shown, u in zip(largest.T, limit, strict=True):
        above = shown[shown > u] - u
        tail += 0.1 * np.exp(-(1.0 - u) / above.mean()) if above.size else 0.0
    return float(6000.0 * tail)


def upper_limit(drives: np.ndarray) -> float:
    """Upper 95 % limit of the expected alarms, over which drives there were [1]: a bootstrap.

    drives : largest shares, shape (drives, minutes, relations)
    """
    random = np.random.default_rng(0)
    drawn = random.integers(len(drives), size=(200, len(drives)))
    return float(np.quantile([expected_alarms(np.concatenate(drives[one])) for one in drawn], 0.95))


def main(first: int, last: int, minutes: int) -> None:
    """Print the largest shares of each drive, or how it ended, and the alarms to expect."""
    found = []
    for seed in range(first, last + 1):
        try:
            found.append(minutes_of(seed, minutes))
            print(seed, found[-1].max(axis=0).round(2), flush=True)
        except AssertionError as error:
            print(seed, "TRIP", error, flush=True)
    drives, hours = np.array(found), (last - first + 1) * minutes / 60.0
    print(
        f"{last - first + 1 - len(found)} trips in {hours:g} hours; the largest sums let expect "
        f"{expected_alarms(np.concatenate(drives)):.2g} in 100, at most {upper_limit(drives):.2g} "
        "(95 %)"
    )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
