"""Parameters of the bench, and parameter sets.

A parameter set is data: TOML with one table for each parameter. This file checks such data and
computes the `calculated` parameters from the `given` ones. `parameter_sets` reads and writes the
files. Source of the nominal set: the thesis, Table 3.1 (LiTH-ISY-EX--17/5092--SE).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite, pi
from typing import Any, Literal

from plant_emulator.errors import ParameterError
from plant_emulator.model.sensors import SENSORS, Sensor, sensors_of

Kind = Literal["given", "estimated", "calculated"]
KINDS: tuple[Kind, ...] = ("given", "estimated", "calculated")


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One constant of the model [SI], with its symbol, unit, kind and source.

    std : prior standard deviation [unit of the value]; None for a value that is not estimated
    standard_error : standard error of a value identified from logs [unit of the value]
    """

    name: str
    symbol: str
    value: float
    unit: str
    kind: Kind
    source: str
    std: float | None = None
    standard_error: float | None = None


def torsional_stiffness(shear_modulus: float, radius: float, length: float) -> float:
    """Torsional stiffness of a round shaft [N m/rad].

    k = G J_p / l,  J_p = pi r^4 / 2                       (thesis, eq. 3.24, 3.25, 3.32, 3.33)

    shear_modulus [Pa], radius [m], length [m]
    """
    return shear_modulus * pi / 2 * radius**4 / length


# The "calculated" rows of the thesis's table: name -> (formula, parameters that it takes).
CALCULATED: dict[str, tuple[Callable[..., float], tuple[str, ...]]] = {
    "motor_shaft_stiffness": (
        torsional_stiffness,
        ("shear_modulus", "motor_shaft_radius", "motor_shaft_length"),
    ),
    "drum_shaft_stiffness": (
        torsional_stiffness,
        ("shear_modulus", "drum_shaft_radius", "drum_shaft_length"),
    ),
}

# All parameters of the model: name -> SI unit.
UNITS: dict[str, str] = {
    "armature_resistance": "ohm",
    "armature_inductance": "H",
    "motor_inertia": "kg m^2",
    "flux_constant": "N m/A",
    "flux_constant_1": "(N m/A)(rad/s)",
    "flux_constant_2": "rad/s",
    "gear_inertia": "kg m^2",
    "gear_ratio": "1",
    "shear_modulus": "Pa",
    "motor_shaft_length": "m",
    "motor_shaft_radius": "m",
    "motor_shaft_stiffness": "N m/rad",
    "drum_shaft_length": "m",
    "drum_shaft_radius": "m",
    "drum_shaft_stiffness": "N m/rad",
    "drum_shaft_damping": "N m s/rad",
    "gear_coulomb_friction": "N m",
    "gear_viscous_friction": "N m (s/rad)^delta_g",
    "gear_friction_exponent": "1",
    "backlash_half_gap": "rad",
    "drum_inertia": "kg m^2",
    "drum_radius": "m",
    "speed_gain": "A/(rad/s)",
    "speed_integral_time": "s",
    "current_gain": "V/A",
    "current_integral_time": "s",
    "dead_time": "s",
    "voltage_limit": "V",
    "armature_current_limit": "A",
    "speed_limit": "rad/s",
    "wheel_radius": "m",
}

# Tables of a parameter file that are not parameters.
ORIGIN, EFFECTS = "origin", "effects"
# Key of the file of an effect that is not shipped, in the table of the effect.
FILE = "file"
# Parameters that may be zero: their term is then absent from the model.
MAY_BE_ZERO = frozenset(
    {
        "gear_inertia",
        "gear_coulomb_friction",
        "gear_viscous_friction",
        "backlash_half_gap",
        "dead_time",
        "flux_constant_2",
    }
)


@dataclass(frozen=True)
class ParameterSet:
    """The constants of one bench: one `Parameter` for each name of `UNITS`.

    origin : how the values were identified (hashes of the logs, date, version); None for a set from
        a publication
    effects : effects of this bench beyond the nominal model: effect -> parameter -> value [SI]
    sensors : declared sensors by channel
    effect_files : files of effects that are not shipped, by effect
    """

    name: str
    parameters: Mapping[str, Parameter]
    origin: Mapping[str, Any] | None = None
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    effect_files: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Parameter:
        """The parameter of that name; KeyError names those of the set."""
        if name not in self.parameters:
            known = ", ".join(self.parameters)
            raise KeyError(f"{self.name}: no parameter {name!r}; known: {known}")
        return self.parameters[name]

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self.parameters.values())

    def __repr__(self) -> str:
        effects = f"; effects: {', '.join(self.effects)}" if self.effects else ""
        return f"<ParameterSet {self.name}: {len(self.parameters)} parameters{effects}>"

    def value(self, name: str) -> float:
        """Value of one parameter [its unit]; KeyError as for the parameter itself."""
        return self[name].value

    def values(self) -> dict[str, float]:
        """All values by name [SI]."""
        return {p.name: p.value for p in self}

    def with_values(self, changes: Mapping[str, float]) -> ParameterSet:
        """A copy with other values [SI].

        Calculated parameters are computed again, except those that are in `changes`. Raises
        ParameterError for an unknown name and for a value that the model cannot run with.
        """
        for name in changes:
            if name not in self.parameters:
                raise ParameterError(
                    f"{self.name}: {name} is no parameter; known: {', '.join(UNITS)}"
                )
        new = {n: replace(p, value=changes.get(n, p.value)) for n, p in self.parameters.items()}
        for name, (formula, inputs) in CALCULATED.items():
            if name not in changes and new[name].kind == "calculated":
                value = formula(*(new[i].value for i in inputs))
                new[name] = replace(new[name], value=value)
        for parameter in new.values():
            check_value(self.name, parameter)
        return replace(self, parameters=new)


def check_value(place: str, parameter: Parameter) -> None:
    """Raise ParameterError for a value that is not finite, negative, or zero where it divides."""
    value, name = parameter.value, parameter.name
    if not isfinite(value) or value < 0 or (value == 0 and name not in MAY_BE_ZERO):
        floor = "at least 0" if name in MAY_BE_ZERO else "above 0"
        raise ParameterError(f"{place}: {name}: {value!r}; a finite number {floor} is needed")


def parameter_set(name: str, table: Mapping[str, Any]) -> ParameterSet:
    """The set of a bench that the tables of a file hold; ParameterError names file and key."""
    return set_of(name, table, UNITS).with_values({})


def set_of(name: str, table: Mapping[str, Any], units: Mapping[str, str]) -> ParameterSet:
    """The set of these parameters that the tables of a file hold, their values as they are.

    units : of the parameters, by name
    Raises ParameterError with file and key.
    """
    unknown = sorted(set(table) - set(units) - {ORIGIN, EFFECTS, SENSORS})
    if unknown:
        raise ParameterError(f"{name}: {unknown[0]} is no parameter; known: {', '.join(units)}")
    missing = sorted(set(units) - set(table))
    if missing:
        raise ParameterError(f"{name}: parameter {missing[0]} is missing")
    given = {key: _parameter(name, key, table[key], unit) for key, unit in units.items()}
    origin = table.get(ORIGIN)
    if origin is not None and not isinstance(origin, Mapping):
        raise ParameterError(f"{name}: {ORIGIN}: a table that says where the values come from")
    effects = _effects(name, table.get(EFFECTS, {}))
    sensors = sensors_of(name, table.get(SENSORS, {}))
    files = {key: str(own[FILE]) for key, own in table.get(EFFECTS, {}).items() if FILE in own}
    return ParameterSet(name, given, origin, effects, sensors, files)


def _effects(place: str, table: object) -> dict[str, dict[str, float]]:
    """Values of the tables [effects.NAME]; whether such an effect exists is checked elsewhere."""
    if not isinstance(table, Mapping) or not all(isinstance(t, Mapping) for t in table.values()):
        raise ParameterError(f"{place}: {EFFECTS}: one table an effect, [{EFFECTS}.NAME]")
    return {
        name: {
            k: _number(place, f"{EFFECTS}.{name}.{k}", value)
            for k, value in values.items()
            if k != FILE
        }
        for name, values in table.items()
    }


KEYS = {"symbol", "value", "unit", "kind", "source", "std", "standard_error"}


def _parameter(place: str, name: str, entry: object, unit: str) -> Parameter:
    """The Parameter that one table of the file holds; unit : that it must have."""
    if not isinstance(entry, Mapping):
        raise ParameterError(f"{place}: {name}: a table with value, unit, symbol, source, kind")
    unknown = sorted(set(entry) - KEYS)
    if unknown:
        raise ParameterError(
            f"{place}: {name}.{unknown[0]}: unknown key; known: {', '.join(sorted(KEYS))}"
        )
    kind = entry.get("kind")
    if kind not in KINDS:
        raise ParameterError(f"{place}: {name}.kind: {kind!r}; one of {', '.join(KINDS)}")
    if entry.get("unit") != unit:
        raise ParameterError(f"{place}: {name}.unit: {entry.get('unit')!r}; must be {unit!r}")
    return Parameter(
        name=name,
        symbol=str(entry.get("symbol", "")),
        value=_value(place, name, entry, kind),
        unit=unit,
        kind=kind,
        source=str(entry.get("source", "")),
        std=_optional(place, name, entry, "std"),
        standard_error=_optional(place, name, entry, "standard_error"),
    )


def _optional(place: str, name: str, entry: Mapping[str, Any], key: str) -> float | None:
    return None if key not in entry else _number(place, f"{name}.{key}", entry[key])


def _value(place: str, name: str, entry: Mapping[str, Any], kind: Kind) -> float:
    """Value of a table; 1.0 for a calculated parameter, until `with_values` computes it."""
    if kind != "calculated":
        return _number(place, f"{name}.value", entry.get("value"))
    if name not in CALCULATED:
        raise ParameterError(f"{place}: {name}.kind: there is no formula for it; give a value")
    if "value" in entry:
        raise ParameterError(f"{place}: {name}.value: it is calculated; leave the value out")
    return 1.0


def _number(place: str, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ParameterError(f"{place}: {key}: {value!r}; a number is needed")
    return float(value)
