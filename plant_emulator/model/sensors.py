"""Known sensors of a bench: what lies between a quantity and its value in a log.

A sensor follows its quantity as a first-order lag, a filter of an amplifier for instance. A task of
the PLC may read it seldom and hold the value. A parameter file declares a sensor in a table:

    [sensors.shaft_torque]
    time_constant_s = 0.02
    period_s = 0.02
    noise = 0.25
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

from plant_emulator.errors import ParameterError

SENSORS = "sensors"
# Channels whose sensor may be declared, with their units.
SENSED = {
    "shaft_torque": "N m",
    "motor_speed": "rad/s",
    "drum_speed": "rad/s",
    "armature_current": "A",
    "armature_voltage": "V",
}
# Key in a file -> field of the record.
KEYS = {"time_constant_s": "time_constant", "period_s": "period", "noise": "noise"}


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """One sensor of the bench [SI].

    time_constant : of its first-order lag [s]; 0: none
    period : of the task that reads the sensor and holds the value [s]; 0: every sample is new
    noise : standard deviation of the white noise of a new value [unit of the channel]; None: not
        declared
    """

    time_constant: float = 0.0
    period: float = 0.0
    noise: float | None = None

    @property
    def immediate(self) -> bool:
        """Whether every value shows its quantity at once."""
        return self.time_constant == self.period == 0.0

    def entries(self) -> dict[str, float]:
        """Keys and values of the sensor's table in a file."""
        found = {key: getattr(self, field) for key, field in KEYS.items()}
        return {key: value for key, value in found.items() if value not in (None, 0.0)}


def sensors_of(place: str, table: object) -> dict[str, Sensor]:
    """Read the tables [sensors.CHANNEL]; ParameterError names file, key and value."""
    if not isinstance(table, Mapping) or not all(isinstance(t, Mapping) for t in table.values()):
        raise ParameterError(f"{place}: {SENSORS}: one table a channel, [{SENSORS}.CHANNEL]")
    return {name: _sensor(place, name, entries) for name, entries in table.items()}


def _sensor(place: str, name: str, entries: Mapping[str, object]) -> Sensor:
    key = f"{SENSORS}.{name}"
    if name not in SENSED:
        raise ParameterError(f"{place}: {key}: no such channel; known: {', '.join(SENSED)}")
    unknown = sorted(entries.keys() - KEYS.keys())
    if unknown:
        known = ", ".join(KEYS)
        raise ParameterError(f"{place}: {key}.{unknown[0]}: unknown key; known: {known}")
    values = {KEYS[k]: _number(f"{place}: {key}.{k}", name, k, v) for k, v in entries.items()}
    return Sensor(**values)


def _number(place: str, name: str, key: str, value: object) -> float:
    unit = SENSED[name] if key == "noise" else "s"
    least = "above 0" if key == "noise" else "of at least 0"
    if isinstance(value, int | float) and not isinstance(value, bool):
        allowed = value > 0.0 if key == "noise" else value >= 0.0
        if isfinite(value) and allowed:
            return float(value)
    raise ParameterError(f"{place}: {value!r}; a finite number {least} {unit} is needed")
