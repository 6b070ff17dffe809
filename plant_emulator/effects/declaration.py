"""The declaration of an effect. One declaration serves simulation, fit and report."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from numbers import Real
from types import FunctionType
from typing import TYPE_CHECKING, Any

from plant_emulator.errors import ParameterError
from plant_emulator.model import laws
from plant_emulator.model.parameters import UNITS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import ModuleType

    from plant_emulator.model.records import Record

SUBSYSTEMS = (
    "drive",
    "motor",
    "motor_shaft",
    "gear",
    "backlash_shaft",
    "drum",
    "torque_sensor",
    "speed_sensor",
    "wheel_contact",
)

# Largest number of starts of a fit between the bounds of a parameter.
MOST_STARTS = 10_000


@dataclass(frozen=True, kw_only=True)
class EffectParameter:
    """One parameter of an effect [SI].

    There are three kinds of parameters. A size makes the effect absent at its neutral value. A
    shape only modifies the effect, and has neutral = plausible. A value per run belongs to one run,
    such as a temperature at its start.

    neutral : value at which the effect is absent; lower, upper : bounds
    plausible : value that is met on real benches; it is used where none is given
    per_run : whether it is a value per run
    measured : signal of a log whose mean is the value in that run, if the log has the signal
    std : prior standard deviation of a shape or of a value per run. Without it a fit leaves a size
        free and fixes a shape. A value per run that has neither std nor a measured signal makes the
        effect a random effect: it must have one size, and a fit tries three values of each shape,
        the plausible one and one std to either side.
    step : largest distance between the starts of a fit such that one start lies in the right basin;
        None: a value per run has a few starts over its prior, other parameters have one
    """

    neutral: float
    lower: float
    upper: float
    plausible: float
    unit: str
    meaning: str
    per_run: bool = False
    measured: str | None = None
    std: float | None = None
    step: float | None = None

    @property
    def angle(self) -> bool:
        """Whether it is an angle per run, on which a small effect depends as a cosine."""
        return self.per_run and self.unit == "rad"


@dataclass(frozen=True)
class Memory:
    """A state that an effect adds to the model.

    start   : p -> value at the start of a run
    advance : (base, a, s, p) -> solution x of x = base + a * rate(x), the implicit stage of this
              memory; it must be finite for a time constant of 0
    follows : name of a law whose value the memory follows, as a filter does; the value is that of
              the effects before this one, and advance is (base, a, value, s, p) -> x
    beside  : another memory of the effect whose stage is solved together with this one, as in an
              oscillation; advance takes the base of that memory before s
    """

    start: Callable[[Record], float]
    advance: Callable[..., float]
    follows: str | None = None
    beside: str | None = None


@dataclass(frozen=True, eq=False)  # compared and hashed by identity: it is loaded once
class Effect:
    """An effect: a change of laws of the nominal model, with its parameters and memories.

    subsystem : where it acts, one of SUBSYSTEMS; description : docstring of its file
    laws : law's name -> (value, s, p) -> changed value; file : path of its file
    needs : sensor or manoeuvre without which a log hardly shows the effect; empty: nothing special
    exact : whether its law can have no other form, as a factor or an offset
    """

    name: str
    subsystem: str
    description: str
    parameters: Mapping[str, EffectParameter]
    memories: Mapping[str, Memory]
    laws: Mapping[str, Callable[[float, Record, Record], float]]
    file: str
    needs: str = ""
    exact: bool = False

    def plausible(self) -> dict[str, float]:
        """Plausible values of all parameters, by name [SI]."""
        return {key: parameter.plausible for key, parameter in self.parameters.items()}

    def complete(self, values: Mapping[str, float]) -> dict[str, float]:
        """Values of all parameters [SI]: those given, else the plausible ones.

        Raises ParameterError for an unknown parameter, and for a value that is no number or outside
        of its bounds.
        """
        for key, value in values.items():
            if key not in self.parameters:
                known = ", ".join(self.parameters)
                raise ParameterError(f"effect {self.name}: {key} is no parameter; known: {known}")
            if not _is_number(value):
                raise ParameterError(f"effect {self.name}: {key}={value!r}; a number is expected")
            bounds = self.parameters[key]
            if not isfinite(value) or not bounds.lower <= value <= bounds.upper:
                raise ParameterError(
                    f"effect {self.name}: {key}={value!r}; "
                    f"{bounds.lower:g} to {bounds.upper:g} {bounds.unit} is allowed"
                )
        return {**self.plausible(), **values}

    def to_json(self) -> dict[str, Any]:
        """The effect as an entry of the document `effects/1`."""
        return {
            "effect": self.name,
            "subsystem": self.subsystem,
            "description": self.description,
            "laws": sorted(self.laws),
            "parameters": [
                {
                    "name": key,
                    "unit": p.unit,
                    "neutral": p.neutral,
                    "lower": p.lower,
                    "upper": p.upper,
                    "plausible": p.plausible,
                    "meaning": p.meaning,
                }
                for key, p in self.parameters.items()
            ],
        }

    def __repr__(self) -> str:
        return f"<Effect {self.name} ({self.subsystem}): {', '.join(self.parameters)}>"


def _is_number(value: object) -> bool:
    return isinstance(value, Real)


def read_effect(name: str, module: ModuleType) -> Effect:
    """The effect that a module declares; ParameterError names what is missing or wrong in it."""
    for needed in ("SUBSYSTEM", "PARAMETERS"):
        if not hasattr(module, needed):
            raise ParameterError(f"effect {name}: {module.__file__} declares no {needed}")
    if module.SUBSYSTEM not in SUBSYSTEMS:
        raise ParameterError(
            f"effect {name}: {module.__file__}: SUBSYSTEM is {module.SUBSYSTEM!r}; one of "
            f"{', '.join(SUBSYSTEMS)} is expected"
        )
    found = {law.__name__: getattr(module, law.__name__, None) for law in laws.LAWS}
    changed = {key: function for key, function in found.items() if function is not None}
    if not changed:
        raise ParameterError(f"effect {name}: {module.__file__} changes no law of the bench")
    for key, function in changed.items():
        if not isinstance(function, FunctionType) or function.__code__.co_argcount != 3:
            raise ParameterError(
                f"effect {name}: {module.__file__}: {key} is no function of (value, s, p)"
            )
    _check_table(name, module, "PARAMETERS", EffectParameter)
    _check_numbers(name, module)
    _check_table(name, module, "MEMORIES", Memory)
    _check_memories(name, module)
    return Effect(
        name=name,
        subsystem=module.SUBSYSTEM,
        description=(module.__doc__ or "").strip(),
        parameters=dict(module.PARAMETERS),
        memories=dict(getattr(module, "MEMORIES", {})),
        laws=changed,
        file=str(module.__file__),
        needs=str(getattr(module, "NEEDS", "")),
        exact=bool(getattr(module, "EXACT", False)),
    )


def _check_table(name: str, module: ModuleType, table: str, kind: type) -> None:
    """Raise ParameterError for a table that is no dict of names to such records."""
    found: Any = getattr(module, table, {})
    if not isinstance(found, dict) or not all(isinstance(one, kind) for one in found.values()):
        raise ParameterError(
            f"effect {name}: {module.__file__}: {table} is no dict of names to {kind.__name__}"
        )


def _check_numbers(name: str, module: ModuleType) -> None:
    """Raise ParameterError for a parameter with a wrong number, or with a name in use."""
    for key, one in module.PARAMETERS.items():
        place = f"effect {name}: {module.__file__}: parameter {key}"
        if not str(key).isidentifier() or f"{name}_{key}" in UNITS:
            raise ParameterError(f"{place}: another name is needed; {name}_{key} cannot be used")
        for what, value, low, high in (
            ("lower", one.lower, -inf, inf),
            ("upper", one.upper, one.lower, inf),
            ("neutral", one.neutral, one.lower, one.upper),
            ("plausible", one.plausible, one.lower, one.upper),
            ("std", 1.0 if one.std is None else one.std, 0.0, inf),
            ("step", 1.0 if one.step is None else one.step, 0.0, inf),
        ):
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise ParameterError(f"{place}: {what} is {value!r}; a number is expected")
            if not isfinite(value) or not low <= value <= high:
                raise ParameterError(
                    f"{place}: {what} is {value:g}; a finite number from {low:g} to {high:g} is "
                    "expected"
                )
        least = (one.upper - one.lower) / MOST_STARTS
        if one.step is not None and one.step <= least:
            raise ParameterError(f"{place}: step is {one.step:g}; more than {least:g} is expected")


def check_random_effect(effect: Effect) -> None:
    """Raise ParameterError for a random effect that has not one size: it cannot be diagnosed.

    A random effect has a value per run that has neither a prior nor a measured signal.
    """
    table = effect.parameters
    random = [k for k, p in table.items() if p.per_run and p.std is None and p.measured is None]
    sizes = [
        key
        for key, p in table.items()
        if not p.per_run and p.std is None and p.plausible != p.neutral
    ]
    if random and len(sizes) != 1:
        raise ParameterError(
            f"effect {effect.name}: {effect.file}: parameter {random[0]} is each run's own; give "
            "it a std (a fit finds it) or the signal that is measured; without either the effect "
            f"is a random effect, and it needs one size, not {len(sizes)}"
        )


def _check_memories(name: str, module: ModuleType) -> None:
    """Raise ParameterError for a memory that follows no law, or is beside no other memory."""
    memories: dict[str, Memory] = getattr(module, "MEMORIES", {})
    names = [law.__name__ for law in laws.LAWS]
    for key, memory in memories.items():
        if memory.follows not in (None, *names):
            raise ParameterError(
                f"effect {name}: {module.__file__}: memory {key} follows {memory.follows!r}, "
                f"which is no law; known: {', '.join(names)}"
            )
        if memory.beside is not None and memory.beside not in memories.keys() - {key}:
            raise ParameterError(
                f"effect {name}: {module.__file__}: memory {key} is beside {memory.beside!r}, "
                "which is no other memory of the effect"
            )
