"""Compare logs with their simulation: Val1, Val2 and NRMSD of every channel."""

from __future__ import annotations

from typing import Any

import click

from plant_emulator.cli import _options

EXAMPLE = """
\b
Example:
  plant-emulator validate run1.csv.gz run2.csv.gz --plot fit.png
"""


@click.command(epilog=EXAMPLE)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@_options.parameters
@_options.effect
@_options.reference
@_options.start
@click.option("--plot", metavar="PNG", help="Draw measured, simulated and residual.")
@_options.json_file
def command(
    logs: tuple[str, ...],
    parameters: str,
    effect_texts: tuple[str, ...],
    reference: str | None,
    start: str,
    plot: str | None,
    json_file: str | None,
) -> None:
    """Simulate each LOG from its own reference and say how well the model follows it.

    Val1 = 100 (1 - NRMSD), Val2 = 100 (1 - sum|e| / sum|y|), percent.
    """
    from plant_emulator import effects, parameter_sets
    from plant_emulator import logs as log_files
    from plant_emulator.session import followed
    from plant_emulator.validate import validate

    values, effect_values = parameter_sets.load(parameters), effects.parse(effect_texts)
    measured = [log_files.read(path) for path in logs]
    pairs = [(log, followed(log, values, effect_values, reference, start)) for log in measured]
    fits = {log.source: validate(log, simulation) for log, simulation in pairs}
    answer: dict[str, Any] = {
        "schema": "validation/1",
        "logs": {
            source: {
                name: {"val1": fit.val1, "val2": fit.val2, "nrmsd": fit.nrmsd}
                for name, fit in channels.items()
            }
            for source, channels in fits.items()
        },
    }
    if plot:
        from plant_emulator.plots import draw_validation

        draw_validation(pairs, plot)
    if json_file:
        _options.write_json(answer, json_file)
    if json_file != "-":
        for source, channels in fits.items():
            click.echo(source)
            click.echo(f"  {'channel':18}{'Val1 %':>9}{'Val2 %':>9}{'NRMSD %':>10}{'rms':>11}")
            for name, fit in channels.items():
                numbers = f"{fit.val1:9.3f}{fit.val2:9.3f}{100 * fit.nrmsd:10.4f}{fit.rms:11.4g}"
                click.echo(f"  {name:18}{numbers}")
