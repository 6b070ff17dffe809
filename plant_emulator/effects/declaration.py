"""How an effect declares itself; the same declaration serves simulation, fit and report."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
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

# Starts that a fit looks through at most, between the bounds of a parameter.
MOST_STARTS = 10_000


@dataclass(frozen=True, kw_only=True)
class EffectParameter:
    """One constant of an effect, SI; `neutral`: there the effect is absent.

    `plausible` is a size met on real benches, used when none is given and by planning tools.
    A parameter that only shapes the effect (absent anyway while another is neutral) has neutral =
    plausible.
    per_run : its value is one run's own, such as a temperature at the start
    measured : the signal of a log whose mean is its value in that run, where the log has it
    std : standard deviation of what is known beforehand of a shape or a value per run; None: a fit
        leaves it free if it is a size, and else where it is. A value per run without, that no
        signal tells, makes the effect's course chance; such an effect has one size, and of a shape
        the likeliest of three values counts: the plausible one and a deviation to either side
    step : how far apart the starts of a fit may lie so that one of them finds the right valley;
        None: of a value per run a few over what is known beforehand do, of others one
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
        """Whether it is an angle of a run, of which a small effect is a cosine."""
        return self.per_run and self.unit == "rad"


@dataclass(frozen=True)
class Memory:
    """A state that an effect adds.

    start   : p -> value at the start of a run
    advance : (base, a, s, p) -> the solution x of x = base + a * rate(x), the memory's own
              implicit stage; it must be finite for a time constant of 0
    follows : name of a law of which the memory takes in the value, as the effects before this one
              leave it (a filter, a lag); advance then is (base, a, value, s, p) -> x
    beside  : another memory of the effect whose base it takes in, before s, where the two stages
              have to be solved together (an oscillation)
    """

    start: Callable[[Record], float]
    advance: Callable[..., float]
    follows: str | None = None
    beside: str | None = None


@dataclass(frozen=True, eq=False)  # compared and hashed as the one object that was loaded
class Effect:
    """An effect as the kernel and the commands see it.

    needs : the sensor or the manoeuvre without which a log hardly shows it; empty: nothing special
    exact : its law can have no other form, as that of a factor or an offset; others are a law among
        several that a machine may follow
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
        """A plausible size of the effect, by parameter."""
        return {key: parameter.plausible for key, parameter in self.parameters.items()}

    def complete(self, values: Mapping[str, float]) -> dict[str, float]:
        """Values of all parameters [SI]: those given, else the plausible ones.

        Raises ParameterError for an unknown parameter and for a value outside of its bounds.
        """
        for key, value in values.items():
            if key not in self.parameters:
                known = ", ".join(self.parameters)
                raise ParameterError(f"effect {self.name}: {key} is no parameter; known: {known}")
            bounds = self.parameters[key]
            if not isfinite(value) or not bounds.lower <= value <= bounds.upper:
                raise ParameterError(
                    f"effect {self.name}: {key}={value!r}; "
                    f"{bounds.lower:g} to {bounds.upper:g} {bounds.unit} is allowed"
                )
        return {**self.plausible(), **values}

    def __repr__(self) -> str:
        return f"<Effect {self.name} ({self.subsystem}): {', '.join(self.parameters)}>"


def effect_of(name: str, module: ModuleType) -> Effect:
    """The effect that a module declares; ParameterError names what is missing or wrong."""
    for needed in ("SUBSYSTEM", "PARAMETERS"):
        if not hasattr(module, needed):
            raise ParameterError(f"effect {name}: {module.__file__} declares no {needed}")
    if module.SUBSYSTEM not in SUBSYSTEMS:
        raise ParameterError(
            f"effect {name}: {module.__file__}: SUBSYSTEM is {module.SUBSYSTEM!r}; one of "
            f"{', '.join(SUBSYSTEMS)} is expected"
        )
    own = {law.__name__: getattr(module, law.__name__, None) for law in laws.LAWS}
    changed = {key: function for key, function in own.items() if function is not None}
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
    """Refuse a table that is no mapping of names to such records."""
    found: Any = getattr(module, table, {})
    if not isinstance(found, dict) or not all(isinstance(one, kind) for one in found.values()):
        raise ParameterError(
            f"effect {name}: {module.__file__}: {table} is no dict of names to {kind.__name__}"
        )


def _check_numbers(name: str, module: ModuleType) -> None:
    """Refuse a parameter whose values are no numbers within its bounds, or whose name is taken."""
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


def check_chance(effect: Effect) -> None:
    """Refuse values of a run that nothing tells in an effect that has not one size: it cannot be
    diagnosed.
    """
    table = effect.parameters
    untold = [k for k, p in table.items() if p.per_run and p.std is None and p.measured is None]
    sizes = [
        key
        for key, p in table.items()
        if not p.per_run and p.std is None and p.plausible != p.neutral
    ]
    if untold and len(sizes) != 1:
        raise ParameterError(
            f"effect {effect.name}: {effect.file}: parameter {untold[0]} is each run's own; give "
            "it a std (a fit finds it) or the signal that is measured; without either the effect's "
            f"course is chance, and it needs one size, not {len(sizes)}"
        )


def _check_memories(name: str, module: ModuleType) -> None:
    """Refuse a memory that follows what is no law, or is beside what is no other memory."""
    memories: dict[str, Memory] = getattr(module, "MEMORIES", {})
    known = [law.__name__ for law in laws.LAWS]
    for key, memory in memories.items():
        if memory.follows not in (None, *known):
            raise ParameterError(
                f"effect {name}: {module.__file__}: memory {key} follows {memory.follows!r}, "
                f"which is no law; known: {', '.join(known)}"
            )
        if memory.beside is not None and memory.beside not in memories.keys() - {key}:
            raise ParameterError(
                f"effect {name}: {module.__file__}: memory {key} is beside {memory.beside!r}, "
                "which is no other memory of the effect"
            )
