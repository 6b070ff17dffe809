"""Error budget of a recorded run: which cause keeps the bench from feeling like the road?

The digital twin of the bench repeats the run with the truck's torque. Then one cause at a time is
made ideal, and at last all of them.

    whole       error of the twin as it is
    alone_i     error as it is less error with cause i ideal: what cause i costs
    interaction what all causes cost together, less the sum of what each costs alone
    left        error with all causes ideal: the drive's own lag

Each error is that of the bench over the road under the same torque: mean force of the emulated road
[N], traction energy [%], speed [km/h rms].
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import register_maps
from gateway.configuration.config import Config
from gateway.offline.evaluation import road_speed, traction_energy
from gateway.physics.road_load import road_load
from gateway.twin.closed_loop import Twin, TwinRun
from register_maps.timing import SCAN
from register_maps.units import KMH

if TYPE_CHECKING:
    from plant_emulator.model.parameters import ParameterSet

MOVING: Final = 0.05
"""[m/s] Speed of the drum's rim above which the truck moves."""
BENCH: Final = {
    "drum_inertia": "drum_inertia_kg_m2",
    "gear_inertia": "gear_inertia_kg_m2",
    "drum_radius": "drum_radius_m",
    "gear_ratio": "gear_ratio",
}
"""Parameter of the set -> key of [bench] by which the regulator knows it."""


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Errors of the bench over the road: force [N], energy [%], speed [km/h]."""

    force: float
    energy: float
    speed: float

    def __sub__(self, other: "Errors") -> "Errors":
        pairs = {key: value - getattr(other, key) for key, value in vars(self).items()}
        return Errors(**pairs)

    def __add__(self, other: "Errors") -> "Errors":
        pairs = {key: value + getattr(other, key) for key, value in vars(self).items()}
        return Errors(**pairs)


NO_ERRORS: Final = Errors(force=0.0, energy=0.0, speed=0.0)


@dataclass(frozen=True, kw_only=True)
class Budget:
    """Errors of the whole run, of each cause alone, of their interaction, and what is left."""

    whole: Errors
    alone: Mapping[str, Errors]
    left: Errors

    @property
    def interaction(self) -> Errors:
        """Interaction of the causes: the error of all less the sum of the single errors."""
        return self.whole - self.left - sum(self.alone.values(), NO_ERRORS)

    @property
    def largest(self) -> str:
        """Cause that costs most of the speed."""
        return max(self.alone, key=lambda name: self.alone[name].speed)

    def to_json(self) -> dict[str, Any]:
        """Return the errors as entries of the document budget/1."""
        return {
            "whole": _entry(self.whole),
            "causes": [{"cause": name, **_entry(one)} for name, one in self.alone.items()],
            "interaction": _entry(self.interaction),
            "left": _entry(self.left),
            "largest": self.largest,
        }

    def __str__(self) -> str:
        rows = {
            **self.alone,
            "interaction": self.interaction,
            "drive": self.left,
            "whole": self.whole,
        }
        head = f"{'cause':24s}{'force N':>12s}{'energy %':>12s}{'speed km/h':>12s}"
        lines = [
            f"{n:24s}{e.force:+12.2f}{e.energy:+12.3f}{e.speed:+12.4f}" for n, e in rows.items()
        ]
        return "\n".join([head, *lines, f"largest: {self.largest}"])


def _entry(errors: Errors) -> dict[str, float]:
    named = asdict(errors)
    return {
        "force_newton": named["force"],
        "energy_percent": named["energy"],
        "speed_km_h": named["speed"],
    }


def ideals(told: Config) -> Mapping[str, Callable[[Twin], Twin]]:
    """Functions that make each cause ideal; told : configuration with the friction of the set."""

    def knows_the_bench(twin: Twin) -> Twin:
        exact = {"under_compensation_percent": 0.0, "under_compensation_slow_percent": 0.0}
        regulator = exact | {"friction": told.document["regulator"]["friction"]}
        values = {f"regulator.{key}": value for key, value in regulator.items()}
        known = {f"bench.{key}": twin.parameters.value(name) for name, key in BENCH.items()}
        return replace(twin, config=twin.config.with_values(values | known))

    return {
        "friction and inertia": knows_the_bench,
        "dead time": _without_dead_time,
        "torque sensor": _without_torque_sensor,
        "speed sensors": _without_speed_sensors,
        "backlash": _without_backlash,
        "quantisation": lambda twin: replace(twin, map=register_maps.load("bench_float32")),
        "poll": lambda twin: _with(twin, {"loop.period_ms": 1e3 * SCAN}),
        "margin at the start": lambda twin: _with(twin, {"regulator.breakaway_Nm": 0.0}),
    }


def _with(twin: Twin, values: Mapping[str, object], **parameters: float) -> Twin:
    return replace(
        twin,
        config=twin.config.with_values(values),
        parameters=twin.parameters.with_values(parameters),
    )


def _without_dead_time(twin: Twin) -> Twin:
    """Neither the dead time of the drive nor the lead against it."""
    lead = max(twin.config.regulator.lead - twin.parameters.value("dead_time"), 0.0)
    values = {"regulator.lead_s": lead, "bench.dead_time_ms": 0.0}
    return _without(_with(twin, values, dead_time=0.0), "delay_jitter", "nothing")


def _without_torque_sensor(twin: Twin) -> Twin:
    """Neither errors of the torque sensor nor their corrections."""
    corrections = ("torque_offset_Nm", "torque_gain_percent", "torque_lag_ms")
    plain = _with(twin, {f"regulator.{key}": 0.0 for key in corrections})
    return _without(plain, "torque_sensor", "shaft_torque")


def _without_speed_sensors(twin: Twin) -> Twin:
    no_drum = _without(twin, "drum_speed", "drum_speed")
    return _without(no_drum, "motor_speed", "motor_speed")


def _without_backlash(twin: Twin) -> Twin:
    return _with(twin, {"bench.backlash_half_gap_rad": 0.0}, backlash_half_gap=0.0)


def _without(twin: Twin, effects: str, sensors: str) -> Twin:
    """Twin without the effects and declared sensors whose names begin like this."""
    p = twin.parameters
    kept = {name: one for name, one in p.effects.items() if not name.startswith(effects)}
    sensed = {name: one for name, one in p.sensors.items() if not name.startswith(sensors)}
    plain: ParameterSet = replace(p, effects=kept, sensors=sensed)
    return replace(twin, parameters=plain)


def budget(twin: Twin, told: Config, run: Callable[[Twin], TwinRun]) -> Budget:
    """Budget of the run of a twin; told : the configuration with the friction of the set."""
    whole, changes, ideal = errors(twin, run(twin)), ideals(told), twin
    alone = {}
    for name, change in changes.items():
        changed, ideal = change(twin), change(ideal)
        # A cause that is not there needs no run.
        alone[name] = NO_ERRORS if changed == twin else whole - errors(changed, run(changed))
    return Budget(whole=whole, alone=alone, left=errors(ideal, run(ideal)))


def errors(twin: Twin, found: TwinRun) -> Errors:
    """Errors of a run over the road of its truck under the same torque."""
    truck, radius = twin.config.truck, twin.parameters.value("drum_radius")
    road = road_load(truck, twin.config.bench)
    speed, force = found.drum_speed * radius, found.wheel_torque / truck.wheel_radius
    wanted = road_speed(found.time, force, truck.total_mass, road.force)
    part = np.flatnonzero(np.maximum(speed, wanted)[1:] > MOVING) + 1
    rolls = part[np.minimum(speed[part], speed[part - 1]) > MOVING]
    resisting = np.array([road.force(float(one)) for one in speed[rolls]])
    inertia = truck.total_mass * (speed[rolls] - speed[rolls - 1]) / SCAN
    energy = traction_energy(found.time, force, wanted)
    return Errors(
        force=float(np.mean(force[rolls] - inertia - resisting)),
        energy=100.0 * (traction_energy(found.time, force, speed) / energy - 1.0),
        speed=float(np.sqrt(np.mean((speed - wanted)[part] ** 2))) / KMH,
    )
