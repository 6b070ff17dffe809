"""Friction of the gear as the regulator knows it: law, values, and their reading from a document.

Default values are those of the thesis (Table 3.1), identified with the gear's shell at 32 degC. The
temperature coefficient is not in the thesis: friction falls with the viscosity of the oil.

A friction file is either a friction map or a parameter set of the whole bench. A friction map has
the keys of RANGES; a measured map also has a table `measured` with its origin, which has no effect.
A parameter set has one table a parameter, and the tables of PARAMETERS are used.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from gateway.errors import ConfigError
from register_maps.units import ZERO_CELSIUS


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Parameters of the friction law at the gear output.

    coulomb [N m], viscous [N m (s/rad)^exponent], exponent [1]
    temperature_coefficient : relative fall of the friction per kelvin of the shell [1/K]
    reference_temperature_celsius : shell temperature at which coulomb and viscous hold [degC]
    """

    coulomb: float = 35.989
    viscous: float = 345.38
    exponent: float = 0.4418
    temperature_coefficient: float = 0.0
    reference_temperature_celsius: float = 32.0

    @property
    def document(self) -> dict[str, float]:
        """Table of the friction as a configuration file has it."""
        return asdict(self)


THESIS = Friction()
RANGES = {
    "coulomb": (0.0, 1e4),
    "viscous": (0.0, 1e5),
    "exponent": (0.05, 2.0),
    "temperature_coefficient": (-0.1, 0.1),
    "reference_temperature_celsius": (-40.0, 150.0),
}
MEASURED = "measured"
PARAMETERS = {
    "gear_coulomb_friction": ("coulomb", "N m"),
    "gear_viscous_friction": ("viscous", "N m (s/rad)^delta_g"),
    "gear_friction_exponent": ("exponent", "1"),
}
"""Table of a parameter set -> key of the friction, and the unit that the table must name."""


def friction_torque(omega: float, friction: Friction, temperature: float | None = None) -> float:
    """Friction torque at the gear output [N m].

    T_f = (f_gc + f_g |omega|^delta_g) sgn(omega) exp(-a (T - T_0))         (thesis, eq 3.27; a = 0)

    omega : speed of the gear output [rad/s]; the friction at rest is 0
    temperature : of the shell [K]; None: unknown, the reference temperature is assumed
    """
    if omega == 0.0:
        return 0.0
    f_gc, f_g, delta_g = friction.coulomb, friction.viscous, friction.exponent
    torque = math.copysign(f_gc + f_g * abs(omega) ** delta_g, omega)
    if temperature is None or friction.temperature_coefficient == 0.0:
        return torque
    above = temperature - ZERO_CELSIUS - friction.reference_temperature_celsius
    return torque * math.exp(-friction.temperature_coefficient * above)


def read_friction(table: object, place: str) -> Friction:
    """Friction in a table. Raises ConfigError, in which `place` names the table."""
    if not isinstance(table, Mapping):
        raise ConfigError("no friction table", place=place, value=table, expected=", ".join(RANGES))
    return Friction(**{key: _read_value(key, value, place) for key, value in table.items()})


def friction_table(document: Mapping[str, Any], file: object) -> dict[str, Any]:
    """Table of the friction in a friction map or a parameter set. Raises ConfigError."""
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
        return {key: _parameter(document, name, file) for name, (key, _) in PARAMETERS.items()}
    if in_map:
        return {key: value for key, value in document.items() if key != MEASURED}
    raise ConfigError(
        "neither a friction map nor a parameter set",
        file=file,
        value=", ".join(document) or "nothing",
        expected=f"{', '.join(RANGES)}, or the tables {', '.join(PARAMETERS)}",
    )


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
    return _in_range(key, table["value"], f"{file}: {name}.value")


def _read_value(key: str, value: Any, place: str) -> float:
    where = f"{place}.{key}"
    if key not in RANGES:
        raise ConfigError("unknown key", place=where, value=key, expected=", ".join(RANGES))
    return _in_range(key, value, where)


def _in_range(key: str, value: Any, where: str) -> float:
    low, high = RANGES[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise ConfigError("bad value", place=where, value=value, expected=f"{low:g} .. {high:g}")
    return float(value)
