"""Compare logs with their simulation: Val1, Val2 and NRMSD of every channel."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command, Number

EXAMPLE = """
\b
Example:
  plant-emulator validate run1.csv.gz run2.csv.gz --plot fit.png
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@_options.parameters
@_options.effect
@_options.reference
@_options.start
@click.option(
    "--filter",
    "cutoff",
    type=Number(min=0.0, min_open=True),
    metavar="HZ",
    help="Low-pass both with the same zero-phase filter first and drop the edges; default: none.",
)
@_options.table
@_options.plot
@_options.json_file
def command(
    logs: tuple[str, ...],
    parameters: str,
    effects: tuple[str, ...],
    reference: Literal["linear", "staircase"] | None,
    start: Literal["fit", "middle"],
    cutoff: float | None,
    table: str | None,
    plot: str | None,
    json_file: str | None,
) -> None:
    """Simulate each LOG from its own reference and say how well the model follows it.

    Val1 = 100 (1 - NRMSD), Val2 = 100 (1 - sum|e| / sum|y|), percent.
    """
    from plant_emulator.workflows.validation import validate

    found = validate(
        logs,
        parameters=parameters,
        effects=effects,
        reference=reference,
        start=start,
        cutoff=cutoff,
    )
    if plot:
        found.plot(plot)
    if table:
        Path(table).write_text(found.to_csv(), encoding="utf-8")
    if json_file:
        _options.write_json(found.to_json(), json_file)
    if json_file != "-":
        click.echo(found.to_text())
