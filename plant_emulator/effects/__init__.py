"""Effects that the nominal model lacks: one file each, found by its name.

An effect is a module with

    SUBSYSTEM    where it acts: drive, motor, motor_shaft, gear, ...
    NEEDS        sensor or manoeuvre without which a log hardly shows it, if there is one
    EXACT        True if its law can have no other form, as a factor or an offset
    PARAMETERS   name -> EffectParameter; at all neutral values the effect is absent
    MEMORIES     name -> Memory, if it has states (a lag, a temperature)

and with one function for each law of `plant_emulator.model.laws` that it changes. The function has
the name of the law: law(value, s, p) -> changed value. `value` is the result of the nominal law and
of the effects before this one.

In these functions a parameter is `p.<effect>_<parameter>`, a memory is `s.<effect>_<memory>`. At
the neutral value a function must return `value` itself, so that no bit of a run changes. The tests
in tests/plant_emulator/effects/test_every_effect.py check every file of this folder.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from collections.abc import Mapping
from itertools import combinations
from keyword import iskeyword
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import (
    Effect,
    EffectParameter,
    Memory,
    check_random_effect,
    read_effect,
)
from plant_emulator.errors import ParameterError, place_in

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path
    from types import ModuleType

__all__ = [
    "Effect",
    "EffectParameter",
    "Memory",
    "complete",
    "effects_of_sets",
    "from_file",
    "from_files",
    "load",
    "names",
    "parse",
    "use_effects_of_set",
]


def names() -> list[str]:
    """Names of the shipped effects."""
    found = (module.name for module in pkgutil.iter_modules(__path__))
    return sorted(name for name in found if name != "declaration")


# Effects of the parameter sets that this process has loaded, beside the shipped ones, by name.
_of_sets: dict[str, Effect] = {}


def use_effects_of_set(own: Sequence[Effect]) -> None:
    """Let this process know these effects, which a parameter set names the files of."""
    _of_sets.update({effect.name: effect for effect in own})


def effects_of_sets() -> tuple[Effect, ...]:
    """Effects of the parameter sets that this process has loaded, beside the shipped ones."""
    return tuple(_of_sets.values())


def load(name: str) -> Effect:
    """The effect of that name, shipped or of a loaded set; ParameterError where there is none."""
    if name in _of_sets:
        return _of_sets[name]
    if name not in names():
        raise ParameterError(f"effect {name}: unknown; known: {', '.join(names())}")
    return read_effect(name, importlib.import_module(f"{__name__}.{name}"))


def from_files(paths: Sequence[Path]) -> list[Effect]:
    """Load a user's own effects; ParameterError where two files would give one name."""
    for first, second in combinations(paths, 2):
        if first.stem == second.stem:
            raise ParameterError(
                f"{second}: an effect is called by its file, and {first} is called "
                f"{first.stem} too; give it another name"
            )
    return [from_file(path) for path in paths]


def from_file(path: Path) -> Effect:
    """Load a user's own effect, named after its file; ParameterError names the line of a fault."""
    if not path.stem.isidentifier() or iskeyword(path.stem):
        raise ParameterError(
            f"{path}: an effect is called by its file, and {path.stem!r} is no name in Python; "
            "letters, digits and _ are, not beginning with a digit"
        )
    if path.stem in names():
        raise ParameterError(
            f"{path}: an effect is called by its file, and {path.stem} is one of the library; "
            "give it another name"
        )
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise ParameterError(f"{path}: no Python file with an effect")
    module: ModuleType = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ParameterError(place_in([str(path)], error) or f"{path}: {error}") from error
    effect = read_effect(path.stem, module)
    check_random_effect(effect)
    return effect


def parse(texts: tuple[str, ...] | list[str]) -> dict[str, dict[str, float]]:
    """Values by effect and parameter [SI] from texts `NAME[:PARAM=VALUE,...]`.

    A parameter that is not given takes its plausible value. Raises ParameterError for a text that
    is not understood, and for a value outside of its bounds.
    """
    return dict(_parse_one(text) for text in texts)


def complete(values: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Values of all parameters of these effects [SI]: those given, else the plausible ones.

    values : by effect and parameter [SI]
    Raises ParameterError for an unknown effect or parameter, and for a value outside of its bounds.
    """
    for name, table in values.items():
        if not isinstance(table, Mapping):
            raise ParameterError(f"effect {name}: {table!r}; a mapping of parameters is expected")
    return {name: load(name).complete(table) for name, table in values.items()}


def _parse_one(text: str) -> tuple[str, dict[str, float]]:
    name, _, rest = text.partition(":")
    effect = load(name)
    values: dict[str, float] = {}
    for item in filter(None, rest.split(",")):
        key, _, number = item.partition("=")
        if key not in effect.parameters:
            known = ", ".join(effect.parameters)
            raise ParameterError(f"effect {text}: {key} is no parameter of {name}; known: {known}")
        try:
            values[key] = float(number)
        except ValueError:
            raise ParameterError(f"effect {text}: {key}={number!r}; a number is needed") from None
    return name, effect.complete(values)


def neutral_values(effects: Mapping[str, Effect]) -> dict[str, float]:
    """Values at which none of the effects is there, by their names in the parameter record."""
    return {
        f"{name}_{key}": parameter.neutral
        for name, effect in effects.items()
        for key, parameter in effect.parameters.items()
    }
