"""List the effects that can be added to the nominal bench, or show one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command

if TYPE_CHECKING:
    from plant_emulator.effects import Effect

EXAMPLE = """
\b
Example:
  plant-emulator effects gear_oil_temperature
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("name", required=False)
@_options.json_file
def command(name: str | None, json_file: str | None) -> None:
    """Show equation, parameters, units and source of the effect NAME; without NAME list all."""
    from plant_emulator import effects

    found = [effects.load(key) for key in ([name] if name else effects.names())]
    if json_file:
        document = {"schema": "effects/1", "effects": [effect.to_json() for effect in found]}
        _options.write_json(document, json_file)
    if json_file == "-":
        return
    for effect in found:
        if name:
            click.echo(_page(effect))
        else:
            click.echo(f"{effect.name:29}{effect.subsystem:15}{effect.description.splitlines()[0]}")


def _page(effect: Effect) -> str:
    """The description of an effect, and a table of its parameters."""
    head = f"{effect.name} ({effect.subsystem})\n\n{effect.description}\n"
    columns = f"\n{'parameter':24}{'unit':8}{'neutral':>10}{'plausible':>11}{'from':>10}{'to':>10}"
    rows = [
        f"{key:24}{p.unit:8}{p.neutral:10g}{p.plausible:11g}{p.lower:10g}{p.upper:10g}  {p.meaning}"
        for key, p in effect.parameters.items()
    ]
    return "\n".join([head + columns, *rows])
