"""The parameter set of an axis as its diagnosis knows it.

`diagnose --model axis --save SET` writes such a set, `--parameters SET` takes it. An effect of it
holds its constants, and under `reference_...` the axis that its sizes refer to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import TYPE_CHECKING

from plant_emulator import parameter_sets
from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.effects.effect import Scale
from plant_emulator.diagnosis.axis.known import KnownAxis
from plant_emulator.diagnosis.axis.motion.run import Base
from plant_emulator.diagnosis.axis.quantities import UNITS
from plant_emulator.diagnosis.axis.regression.fit import NAMES
from plant_emulator.diagnosis.axis.regression.rows import KnownEffect, Term
from plant_emulator.errors import ParameterError
from plant_emulator.model.parameters import ParameterSet, set_of
from plant_emulator.workflows.axis_files.own_effects import own_effects

if TYPE_CHECKING:
    from pathlib import Path

    from plant_emulator.diagnosis.axis.effects import Effect

REFERENCE = "reference_"
# Fields of the axis that an effect refers to, less the kind of the axis, which its units tell.
OF_BASE = tuple(one.name for one in fields(Base))
OF_SCALE = tuple(one.name for one in fields(Scale) if one.name != "rotary")


def reference_entries(base: Base, scale: Scale) -> dict[str, float]:
    """Entries of an effect in a set for the axis that its sizes refer to."""
    told = {**asdict(base), **asdict(scale)}
    return {f"{REFERENCE}{name}": float(told[name]) for name in (*OF_BASE, *OF_SCALE)}


def load(name: str | Path) -> ParameterSet:
    """The set of an axis in that file; ParameterError with file and key for any other one."""
    path, table = parameter_sets.read(name)
    origin = table.get("origin")
    if not isinstance(origin, Mapping) or origin.get("model") != "axis":
        raise ParameterError(
            f"{name}: no set of an axis; one that diagnose --model axis --save wrote is needed"
        )
    units = next((u for u in UNITS.values() if _unit(table) == u["inertia"]), UNITS[True])
    return parameter_sets.with_files_from(path, set_of(str(name), table, units))


def known_axis(given: ParameterSet) -> KnownAxis:
    """Nominal parameters and effects of a set; ParameterError with set and key for a fault."""
    rotary = given["inertia"].unit == UNITS[True]["inertia"]
    own = own_effects(list(given.effect_files.values()))
    return KnownAxis(
        values=tuple(given.value(name) for name in NAMES),
        errors=tuple(given[name].standard_error or 0.0 for name in NAMES),
        effects=tuple(
            _known_effect(given.name, name, values, own, rotary=rotary)
            for name, values in given.effects.items()
        ),
        own=own,
        rotary=rotary,
    )


def _unit(table: Mapping[str, object]) -> object:
    entry = table.get("inertia")
    return entry.get("unit") if isinstance(entry, Mapping) else None


def _known_effect(
    place: str, name: str, values: Mapping[str, float], own: tuple[Effect, ...], *, rotary: bool
) -> KnownEffect:
    """An effect of a set, with the axis that its sizes refer to."""
    library = [effect for effect in (*own, *LIBRARY) if effect.name == name]
    if not library:
        raise ParameterError(
            f"{place}: effects.{name}: unknown; `plant-emulator effects --model axis` lists those "
            "of the library, and an effect of your own needs its file"
        )
    constants = {key for key in values if not key.startswith(REFERENCE)}
    wanted = [{one.name for one in effect.constants} for effect in library]
    if constants not in wanted:
        told = " or ".join(", ".join(sorted(one)) for one in wanted)
        raise ParameterError(
            f"{place}: effects.{name}: {', '.join(sorted(constants)) or 'no constants'}; "
            f"{told} are needed"
        )
    effect = library[wanted.index(constants)]
    missing = [key for key in (*OF_BASE, *OF_SCALE) if f"{REFERENCE}{key}" not in values]
    if missing:
        raise ParameterError(f"{place}: effects.{name}.{REFERENCE}{missing[0]} is missing")
    base, scale = (
        {key: values[f"{REFERENCE}{key}"] for key in names} for names in (OF_BASE, OF_SCALE)
    )
    return KnownEffect(
        term=Term(effect, tuple(values[one.name] for one in effect.shapes)),
        sizes=tuple(values[one.name] for one in effect.sizes),
        base=Base(**base),
        scale=Scale(**scale, rotary=rotary),
    )
