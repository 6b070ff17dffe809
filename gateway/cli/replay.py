"""Replay a recording or a log through the regulator, bit for bit or with other parameters."""

from pathlib import Path

import click

from gateway.cli._shared.options import assignments, write_json
from gateway.reports.replay import draw, write_csv
from gateway.workflows.learning import save_memory
from gateway.workflows.replay import replay
from register_maps.command_line.parameters import PICTURES, Command, OutputFile

EXAMPLE = """
\b
Examples:
  gateway replay recordings/20261121T061045.260875Z.rlrec
  gateway replay program6.csv.gz --set regulator.name=thesis --plot replay.png
"""
PICTURE = OutputFile(endings=PICTURES, path_type=Path)


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("file", metavar="LOG|RECORDING", type=click.Path(path_type=Path))
@click.option("-c", "--config", type=click.Path(path_type=Path), help="TOML file")
@click.option(
    "--set",
    "values",
    multiple=True,
    metavar="KEY=VALUE",
    help="change a value of the configuration",
)
@click.option("--out", type=OutputFile(path_type=Path), help="write both setpoints to a CSV file")
@click.option("--plot", type=PICTURE, help="draw both setpoints (PNG)")
@click.option(
    "--save-learned",
    type=OutputFile(path_type=Path),
    help="write what the learned regulator remembers after the run (TOML)",
)
@click.option("--json", "json_file", type=OutputFile(dash=True), help="run/1; - = stdout")
def command(
    file: Path,
    config: Path | None,
    *,
    values: tuple[str, ...],
    out: Path | None,
    plot: Path | None,
    save_learned: Path | None,
    json_file: str | None,
) -> int:
    """Put the measurements of a run through regulator, supervisor and limits again.

    A RECORDING without -c and --set must come out bit for bit; otherwise the exit code is 1. In all
    other cases the new setpoint is compared with the recorded setpoint or the logged reference.
    """
    result = replay(file, config=config, values=assignments(values))
    for warning in result.warnings:
        click.echo(f"warning: {file}: {warning}", err=True)
    if out is not None:
        write_csv(out, result.comparison)
    if plot is not None:
        draw(plot, result.comparison)
    if save_learned is not None:
        save_memory(file, result.config, save_learned)
    if json_file is not None:
        write_json(json_file, result.to_json())
    if json_file != "-":
        click.echo(result.summary())
    return 0 if result.holds else 1
