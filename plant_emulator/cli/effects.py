"""List the effects that can be added to the nominal bench, or show one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command

if TYPE_CHECKING:
    from plant_emulator.diagnosis.axis.effects.effect import Effect as AxisEffect
    from plant_emulator.effects import Effect

EXAMPLE = """
\b
Examples:
  plant-emulator effects gear_oil_temperature
  plant-emulator effects --model axis backlash
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("name", required=False)
@_options.model
@_options.json_file
def command(name: str | None, model: Literal["bench", "axis"], json_file: str | None) -> None:
    """Show equation, parameters, units and source of the effect NAME; without NAME list all."""
    from plant_emulator import effects

    found: list[Effect] | list[AxisEffect]
    if model == "axis":
        found = _of_axis(name)
    else:
        found = [effects.load(key) for key in ([name] if name else effects.names())]
    if json_file:
        document = {"schema": "effects/1", "effects": [effect.to_json() for effect in found]}
        _options.write_json(document, json_file)
    if json_file == "-":
        return
    for effect in found:
        if name:
            click.echo(_page(effect) if isinstance(effect, effects.Effect) else _axis_page(effect))
        else:
            click.echo(f"{effect.name:29}{effect.subsystem:15}{_first_line(effect)}")


def _first_line(effect: Effect | AxisEffect) -> str:
    return str(effect.to_json()["description"]).splitlines()[0]


def _of_axis(name: str | None) -> list[AxisEffect]:
    """Effects of an axis by this name, or all; an effect may have a form for other channels."""
    from plant_emulator.diagnosis.axis.effects import LIBRARY, NAMES
    from plant_emulator.errors import ParameterError

    found = [effect for effect in LIBRARY if name in (None, effect.name)]
    if not found:
        raise ParameterError(f"effect {name}: unknown; known: {', '.join(sorted(NAMES))}")
    return found


def _axis_page(effect: AxisEffect) -> str:
    """Description of an effect of an axis, and a table of its parameters."""
    needs = f"\nneeds {effect.needs}\n" if effect.needs else ""
    head = f"{effect.name} ({effect.subsystem})\n\n{effect.title}\n{effect.equation}\n{needs}"
    columns = f"\n{'parameter':24}{'unit, linear':18}unit, rotary"
    return "\n".join(
        [head + columns, *(f"{p.name:24}{p.unit[0]:18}{p.unit[1]}" for p in effect.constants)]
    )


def _page(effect: Effect) -> str:
    """The description of an effect, and a table of its parameters."""
    head = f"{effect.name} ({effect.subsystem})\n\n{effect.description}\n"
    columns = f"\n{'parameter':24}{'unit':8}{'neutral':>10}{'plausible':>11}{'from':>10}{'to':>10}"
    rows = [
        f"{key:24}{p.unit:8}{p.neutral:10g}{p.plausible:11g}{p.lower:10g}{p.upper:10g}  {p.meaning}"
        for key, p in effect.parameters.items()
    ]
    return "\n".join([head + columns, *rows])
