"""Finds faults in a user's own effect and names the line of the file."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

from plant_emulator import effects
from plant_emulator.errors import ParameterError, place_in
from plant_emulator.model import stage
from plant_emulator.model.parameters import UNITS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from plant_emulator.effects import Effect
    from plant_emulator.model.records import Record

# Implicit step that the memories are called with [s].
SHORT = 1e-3


class Stage(SimpleNamespace):
    """A plain stage record; errors show the name of this class."""


class Parameters(SimpleNamespace):
    """A plain parameter record; errors show the name of this class."""


def memory_names(library: Mapping[str, Effect]) -> list[str]:
    """Names of all memories in the stage record, in the order of the state vector."""
    return [f"{effect.name}_{memory}" for effect in library.values() for memory in effect.memories]


def check_effects(library: Mapping[str, Effect]) -> None:
    """Call each function of a user's own effects once, at rest, at the effect's plausible size.

    Raises ParameterError with file and line for a fault. The functions run uncompiled, because the
    compiler would not name the line of a misspelt name. A division by zero is not a fault here:
    compiled it gives infinity, and the simulation refuses a result that is not finite.
    """
    for name in library.keys() - effects.names():
        _check_one(library[name], library)


def _check_one(effect: Effect, library: Mapping[str, Effect]) -> None:
    for function, arguments in _calls(effect, library):
        try:
            float(function(*arguments))
        except ArithmeticError:
            continue
        except Exception as error:
            raise_in_effects(error, library)
            line = function.__code__.co_firstlineno
            raise ParameterError(
                f"{effect.file}:{line}: {function.__name__} gives no number: {error}"
            ) from error


def _calls(
    effect: Effect, library: Mapping[str, Effect]
) -> Iterator[tuple[Callable[..., Any], tuple[Any, ...]]]:
    plausible = {f"{effect.name}_{key}": value for key, value in effect.plausible().items()}
    neutral = effects.neutral_values(library)
    p = cast("Record", Parameters(**dict.fromkeys(UNITS, 1.0) | neutral | plausible))
    s = cast("Record", Stage(**dict.fromkeys((*stage.STAGE, *memory_names(library)), 0.0)))
    for law in effect.laws.values():
        yield law, (0.0, s, p)
    for memory in effect.memories.values():
        yield memory.start, (p,)
        value = () if memory.follows is None else (0.0,)
        base = () if memory.beside is None else (0.0,)
        yield memory.advance, (0.0, SHORT, *value, *base, s, p)


def raise_in_effects(error: Exception, library: Mapping[str, Effect]) -> None:
    """Raise ParameterError with file and line if an error arose in the file of an effect."""
    place = place_in((effect.file for effect in library.values()), error)
    if place is not None:
        raise ParameterError(place) from error
