"""Loads parameter sets and checks the effects in them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from plant_emulator import effects, parameter_sets
from plant_emulator.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.effects import Effect
    from plant_emulator.model.parameters import ParameterSet


def load(
    name: str | Path = parameter_sets.DEFAULT, effect_files: Sequence[str | Path] = ()
) -> ParameterSet:
    """Load the set of that name or path and check its effects; the process knows them from then on.

    effect_files : files of a user's own effects, which the set may have beside those it names
    Raises ParameterError with file and key, also for an unknown effect or effect parameter.
    """
    found = parameter_sets.load(name)
    if found.effects:
        own = effects.from_files([Path(file) for file in found.effect_files.values()])
        effects.use_effects_of_set(own)
        others = effects.from_files([Path(file) for file in effect_files])
        mine = {effect.name: effect for effect in (*own, *others)}
        for key, values in found.effects.items():
            _check(found.name, key, values, mine)
    return found


def _check(place: str, name: str, values: Mapping[str, float], own: Mapping[str, Effect]) -> None:
    if name not in own and name not in effects.names():
        raise ParameterError(
            f"{place}: effects.{name}: unknown; an effect of your own needs its file: give it to "
            "diagnose, or put it into plant_emulator/effects; known: "
            f"{', '.join([*effects.names(), *own])}"
        )
    effect = own[name] if name in own else effects.load(name)
    for key in values:
        if key not in effect.parameters:
            known = ", ".join(effect.parameters)
            raise ParameterError(f"{place}: effects.{name}.{key}: unknown; known: {known}")
