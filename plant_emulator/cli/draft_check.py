"""Tell how much of the held-out gap an effect file of your own closes."""

from __future__ import annotations

from typing import Literal

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command

EXAMPLE = """
\b
Example:
  plant-emulator draft-check amplifier_filter.py run1.csv.gz run2.csv.gz
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("file", metavar="FILE.py")
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@_options.parameters
@_options.model
@_options.columns
@_options.json_file
def command(
    file: str,
    logs: tuple[str, ...],
    parameters: str,
    model: Literal["bench", "axis"],
    columns: tuple[str, ...],
    json_file: str | None,
) -> None:
    """Fit the effect of FILE.py to LOGs, and predict each of them from the others with it.

    The share of the gap that closes says what the effect explains, alone and with all parameters
    re-estimated. A single LOG is fitted on its first part and predicted on the rest.
    """
    from plant_emulator.workflows.diagnosis.draft_check import draft_check

    _options.refuse_of_another(model, {"parameters": "--parameters"}, {"columns": "--column"})
    found = draft_check(file, logs, parameters=parameters, model=model, columns=columns)
    if json_file:
        _options.write_json(found.to_json(), json_file)
    if json_file != "-":
        click.echo(found.to_text())
