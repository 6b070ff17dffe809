"""Estimate parameters from logs, with standard errors, and say what the logs cannot tell."""

from __future__ import annotations

from pathlib import Path

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
    effect_texts: tuple[str, ...],
    reference: str | None,
    save: str | None,
    table: str | None,
    plot: str | None,
    json_file: str | None,
) -> None:
    """Fit the bench's parameters to LOGs, all at once.

    Without --free all parameters that the set calls estimated, except gear_inertia, and with a
    logged voltage also armature_resistance and flux_constant. The start
    position in the backlash gap is fitted for every log. Standard errors come from the residuals,
    with their autocorrelation.
    """
    from plant_emulator import effects, parameter_sets
    from plant_emulator.cli._progress import progress
    from plant_emulator.identification.report import spreadsheet
    from plant_emulator.parameter_sets import with_effects
    from plant_emulator.workflows.identification import identified

    own = effects.parse(effect_texts)
    with progress() as tell:
        result = identified(
            logs,
            held_out,
            with_effects.load(parameters),
            free,
            effects=own,
            hold=reference,
            progress=tell,
        )
    for note in result.notes:
        click.echo(f"note: {note}", err=True)
    if save:
        parameter_sets.save(result.parameter_set(), save)
    if table:
        Path(table).write_text(spreadsheet(result.found), encoding="utf-8")
    if plot:
        from plant_emulator.workflows.validation_plot import draw_validation

        draw_validation(result.pairs, plot)
    if json_file:
        _options.write_json(result.answer(), json_file)
    if json_file != "-":
        click.echo("\n".join(result.lines()))
    estimate = result.found.estimate
    if not estimate.converged:
        raise click.ClickException(
            f"the fit did not converge ({estimate.message}); fewer free parameters, or runs that "
            "excite them, may help"
        )
