"""Write a recording as a CSV, Parquet or MDF4 log."""

from pathlib import Path

import click

from gateway.recordings import export, recording
from gateway.recordings.header import map_of
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Example:
  gateway export recordings/20261121T061045.260875Z.rlrec --to run.csv
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("file", metavar="RECORDING", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "target",
    type=OutputFile(path_type=Path),
    required=True,
    help="FILE.csv, .csv.gz, .parquet or .mf4",
)
def command(file: Path, target: Path) -> None:
    """Write the samples of a RECORDING as a log that all commands read."""
    found = recording.read(file)
    columns = export.columns(found, map_of(found.header))
    export.write(target, columns, export.start_date(found))
    if found.note:
        click.echo(f"note: {found.note}", err=True)
    click.echo(f"{target}: {len(columns['time_s'])} samples of {len(found)} ticks")
