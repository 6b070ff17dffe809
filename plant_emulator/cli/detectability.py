"""Tell before a test what its runs can and cannot show of every effect."""

from __future__ import annotations

from typing import Literal

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command

EXAMPLE = """
\b
Examples:
  plant-emulator detectability program1 program2 program3
  plant-emulator detectability run1.csv.gz program4 --json plan.json
  plant-emulator detectability --model axis run.csv --column position=enc:deg
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("runs", nargs=-1, required=True, metavar="LOG|PROGRAM...")
@_options.model
@_options.parameters
@_options.reference
@_options.columns
@_options.json_file
def command(
    runs: tuple[str, ...],
    model: Literal["bench", "axis"],
    parameters: str,
    reference: Literal["linear", "staircase"] | None,
    columns: tuple[str, ...],
    json_file: str | None,
) -> None:
    """Tell the smallest size of every effect that recorded or planned RUNS show together.

    The table also names the effects that the RUNS cannot distinguish, and what they lack to show an
    effect at all.
    """
    from plant_emulator.workflows.detectability import detectability

    of_bench = {"parameters": "--parameters", "reference": "--reference"}
    _options.refuse_of_another(model, of_bench, {"columns": "--column"})
    found = detectability(
        runs, model=model, parameters=parameters, reference=reference, columns=columns
    )
    for note in found.notes:
        click.echo(f"note: {note}", err=True)
    if json_file:
        _options.write_json(found.to_json(), json_file)
    if json_file != "-":
        click.echo(found.to_text())
