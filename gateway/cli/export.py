"""Write a recording as a CSV, Parquet or MDF4 log."""

from math import inf
from pathlib import Path

import click

from gateway.errors import ConfigError
from gateway.recordings import log_writer, recording
from gateway.recordings.export import Export, Extent
from register_maps.command_line.parameters import Command, Number, OutputFile

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
@click.option(
    "--all",
    "every",
    is_flag=True,
    help="every tick by the gateway's clock, also those without a valid sample",
)
@click.option("--from", "begin", type=Number(), metavar="S", help="first time_s of the log")
@click.option("--to-time", "end", type=Number(), metavar="S", help="last time_s of the log")
def command(
    file: Path, target: Path, begin: float | None, end: float | None, *, every: bool
) -> None:
    """Write the samples of a RECORDING as a log that all commands read."""
    extent = Extent(
        every=every,
        begin=-inf if begin is None else begin,
        end=inf if end is None else end,
    )
    if not extent.begin < extent.end:
        raise ConfigError(
            "no time between them",
            place="--from, --to-time",
            value=f"{begin}, {end}",
            expected="--from before --to-time",
        )
    found = recording.stream(file)
    export = Export(found, extent)
    log_writer.write(target, export)
    if found.note:
        click.echo(f"note: {found.note}", err=True)
    click.echo(f"{target}: {export.survey.samples} samples of {len(found)} ticks")
    if not every:
        click.echo(str(export.survey.quality))
