"""Reading of a friction table, and of the friction in a friction map or a parameter set.

A friction map has the keys of RANGES and a table for each effect; a measured map also has a table
`measured` with its origin, which has no effect. A parameter set of the whole bench has one table a
parameter, of which those of PARAMETERS are used, and one table an effect in `effects`.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Final

from gateway.errors import ConfigError
from gateway.friction.law import Bearings, Friction, LoadLoss, OilTemperature, Stribeck

RANGES: Final = {
    "coulomb": (0.0, 1e4),
    "viscous": (0.0, 1e5),
    "exponent": (0.05, 2.0),
    "temperature_coefficient": (-0.1, 0.1),
    "reference_temperature_celsius": (-40.0, 150.0),
}
EFFECTS: Final[dict[str, tuple[type, dict[str, tuple[float, float]]]]] = {
    "gear_oil_temperature": (
        OilTemperature,
        {
            "viscosity_coefficient": (0.0, 0.1),
            "nominal_temperature": (233.15, 423.15),
            "heat_capacity": (1e2, 1e8),
            "shell_conductance": (0.0, 1e5),
            "start_temperature": (193.15, 423.15),
            "shell_temperature": (193.15, 423.15),
        },
    ),
    "load_dependent_gear_loss": (LoadLoss, {"share": (0.0, 0.5), "difference": (-0.9, 0.9)}),
    "drum_bearing_friction": (
        Bearings,
        {"coulomb": (0.0, 1e3), "viscous": (0.0, 1e3), "exponent": (0.3, 2.0)},
    ),
    "stribeck": (Stribeck, {"rise": (0.0, 1e3), "speed": (0.01, 5.0)}),
}
"""Effect -> its record, and the ranges of its parameters [SI]."""
LEFT_OUT: Final = "left_out"
MEASURED: Final = "measured"
PARAMETERS: Final = {
    "gear_coulomb_friction": ("coulomb", "N m"),
    "gear_viscous_friction": ("viscous", "N m (s/rad)^delta_g"),
    "gear_friction_exponent": ("exponent", "1"),
}
"""Table of a parameter set -> key of the friction, and the unit that the table must name."""
SENSOR: Final = {
    "torque_sensor_offset": ("offset", "torque_offset_Nm", 1.0),
    "torque_sensor_gain": ("error", "torque_gain_percent", 100.0),
    "torque_sensor_lag": ("time_constant", "torque_lag_ms", 1000.0),
}
"""Effect of the sensor -> its parameter, key of [regulator] that takes it out, and the factor."""
ASYMMETRY: Final = "friction_asymmetry"


def read_friction(table: object, place: str) -> Friction:
    """Friction in a table. Raises ConfigError, in which `place` names the table."""
    if not isinstance(table, Mapping):
        raise ConfigError("no friction table", place=place, value=table, expected=", ".join(RANGES))
    return Friction(**{key: _read(key, value, place) for key, value in table.items()})


def _read(key: str, value: Any, place: str) -> Any:
    where = f"{place}.{key}"
    if key == LEFT_OUT:
        return tuple(map(str, value)) if isinstance(value, list) else (str(value),)
    if key not in EFFECTS:
        return _read_number(key, RANGES, value, place)
    record, ranges = EFFECTS[key]
    if not isinstance(value, Mapping):
        raise ConfigError("no table", place=where, value=value, expected=", ".join(ranges))
    return record(**{name: _read_number(name, ranges, one, where) for name, one in value.items()})


def regulator_entries(document: Mapping[str, Any], file: object) -> dict[str, Any]:
    """Entries of [regulator] in a friction map or a parameter set. Raises ConfigError.

    The entry `friction` is a table; the others correct the torque sensor as the set tells it.
    """
    in_set = [name for name in PARAMETERS if name in document]
    in_map = [key for key in RANGES if key in document]
    if in_set and in_map:
        raise ConfigError(
            "both a parameter set and a friction map",
            file=file,
            value=f"{in_set[0]} and {in_map[0]}",
            expected="one of them",
        )
    if in_set:
        return _of_set(document, file)
    if in_map:
        return {"friction": {k: value for k, value in document.items() if k != MEASURED}}
    raise ConfigError(
        "neither a friction map nor a parameter set",
        file=file,
        value=", ".join(document) or "nothing",
        expected=f"{', '.join(RANGES)}, or the tables {', '.join(PARAMETERS)}",
    )


def _of_set(document: Mapping[str, Any], file: object) -> dict[str, Any]:
    table: dict[str, Any] = {
        key: _parameter(document, name, file) for name, (key, _) in PARAMETERS.items()
    }
    entries: dict[str, Any] = {"friction": table}
    effects = document.get("effects", {})
    if not isinstance(effects, Mapping) or not all(map(_is_table, effects.values())):
        raise ConfigError(
            "no effects", file=file, place="effects", value=effects, expected="a table an effect"
        )
    left_out = []
    for name, values in effects.items():
        if name in EFFECTS:
            known = {one.name for one in fields(EFFECTS[name][0])}
            table[name] = {key: value for key, value in values.items() if key in known}
        elif name in SENSOR:
            parameter, key, factor = SENSOR[name]
            entries[key] = factor * _number(values.get(parameter, 0.0), f"{file}: effects.{name}")
        elif name == ASYMMETRY:
            forward = 1.0 + _number(values.get("asymmetry", 0.0), f"{file}: effects.{name}")
            table["coulomb"] *= forward
            table["viscous"] *= forward
        else:
            left_out.append(name)
    return entries if not left_out else {**entries, "friction": {**table, LEFT_OUT: left_out}}


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping)


def _parameter(document: Mapping[str, Any], name: str, file: object) -> float:
    """Value of one parameter in a parameter set."""
    key, unit = PARAMETERS[name]
    table = document.get(name)
    if not isinstance(table, Mapping) or "value" not in table:
        raise ConfigError(
            "no value", file=file, place=name, value=table, expected="a table with value and unit"
        )
    if table.get("unit") != unit:
        raise ConfigError(
            "wrong unit", file=file, place=f"{name}.unit", value=table.get("unit"), expected=unit
        )
    return _in_range(RANGES[key], table["value"], f"{file}: {name}.value")


def _read_number(
    key: str, ranges: Mapping[str, tuple[float, float]], value: Any, place: str
) -> float:
    where = f"{place}.{key}"
    if key not in ranges:
        known = ", ".join(ranges if ranges is not RANGES else [*RANGES, *EFFECTS])
        raise ConfigError("unknown key", place=where, value=key, expected=known)
    return _in_range(ranges[key], value, where)


def _number(value: Any, where: str) -> float:
    return _in_range((-1e9, 1e9), value, where)


def _in_range(between: tuple[float, float], value: Any, where: str) -> float:
    low, high = between
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise ConfigError("bad value", place=where, value=value, expected=f"{low:g} .. {high:g}")
    return float(value)
