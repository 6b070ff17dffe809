"""Estimate parameters from logs, with standard errors, and say what the logs cannot tell."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Examples:
  plant-emulator identify program1.csv.gz program3.csv.gz --hold-out program2.csv.gz \\
      --save bench.toml
  plant-emulator identify run.csv --free gear_viscous_friction --free gear_coulomb_friction
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@_options.parameters
@click.option("--free", multiple=True, metavar="NAME", help="Estimate only these; may be repeated.")
@click.option(
    "--hold-out",
    "held_out",
    multiple=True,
    metavar="LOG",
    help="A run that is not fitted but predicted; may be repeated.",
)
@_options.effect
@_options.reference
@click.option("--save", type=OutputFile(), help="Write the fitted parameter set (TOML).")
@_options.table
@_options.plot
@_options.json_file
def command(
    logs: tuple[str, ...],
    parameters: str,
    free: tuple[str, ...],
    held_out: tuple[str, ...],
    effects: tuple[str, ...],
    reference: Literal["linear", "staircase"] | None,
    save: str | None,
    table: str | None,
    plot: str | None,
    json_file: str | None,
) -> None:
    """Fit the bench's parameters to LOGs, all at once.

    Without --free, all parameters that the set calls estimated are fitted, except gear_inertia. A
    logged voltage adds armature_resistance and flux_constant. Trucks alone, whose wheel torque
    nobody measured, tell nothing of gear friction and drum. Every log has its own start position
    in the backlash gap. The noise is estimated from the logs, with its colour, hum and outliers.
    Standard errors come from the residuals and their autocorrelation.
    """
    from plant_emulator import parameter_sets
    from plant_emulator.cli._progress import progress
    from plant_emulator.workflows.identification import identify

    with progress() as report:
        found = identify(
            logs,
            parameters=parameters,
            free=free,
            hold_out=held_out,
            effects=effects,
            reference=reference,
            progress=report,
        )
    for note in found.notes:
        click.echo(f"note: {note}", err=True)
    if save:
        parameter_sets.save(found.parameter_set, save)
    if table:
        Path(table).write_text(found.to_csv(), encoding="utf-8")
    if plot:
        found.plot(plot)
    if json_file:
        _options.write_json(found.to_json(), json_file)
    if json_file != "-":
        click.echo(found.to_text())
    if not found.converged:
        raise click.ClickException(
            f"the fit did not converge ({found.fit.estimate.message}); fewer free parameters, or "
            "runs that excite them, may help"
        )
