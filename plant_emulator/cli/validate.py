"""Compare logs with their simulation: Val1, Val2 and NRMSD of every channel."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

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
    effect_texts: tuple[str, ...],
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
    from plant_emulator import effects
    from plant_emulator import logs as log_files
    from plant_emulator.identification.report import measures, table_of, table_rows
    from plant_emulator.parameter_sets import with_effects
    from plant_emulator.simulation.fit_metrics import validate, zero_phase
    from plant_emulator.workflows.simulation import simulate_log

    values, effect_values = with_effects.load(parameters), effects.parse(effect_texts)
    measured = [log_files.read(path) for path in logs]
    pairs = [(log, simulate_log(log, values, effect_values, reference, start)) for log in measured]
    if cutoff is not None:
        pairs = [(zero_phase(log, cutoff), zero_phase(other, cutoff)) for log, other in pairs]
    fits = {log.source: validate(log, simulation) for log, simulation in pairs}
    answer: dict[str, Any] = {"schema": "validation/1", "logs": measures(fits)}
    if plot:
        from plant_emulator.workflows.validation_plot import draw_validation

        draw_validation(pairs, plot)
    if table:
        Path(table).write_text(table_of(fits), encoding="utf-8")
    if json_file:
        _options.write_json(answer, json_file)
    if json_file != "-":
        for source, channels in fits.items():
            click.echo("\n".join([source, *table_rows(channels)]))
