"""Check before a day's runs: tare, signs, ratio, warm-up, clock, disk, register map."""

from functools import partial
from pathlib import Path

import click

from gateway.cli._shared.options import assignments, write_json
from register_maps.command_line.parameters import Command, Number, OutputFile

EXAMPLE = """
\b
Examples:
  gateway ready -c bench.toml
  gateway ready -c bench.toml --warm-up 600 --json ready.json
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option("-c", "--config", type=click.Path(path_type=Path), required=True, help="TOML file")
@click.option(
    "--warm-up",
    type=Number(5.0, 7200.0),
    default=300.0,
    show_default=True,
    metavar="S",
    help="time at 2000 rpm; the friction has to be flat within 0.5 % over 5 minutes",
)
@click.option(
    "--set", "values", multiple=True, metavar="KEY=VALUE", help="change a value of the file"
)
@click.option(
    "--json", "json_file", type=OutputFile(dash=True), help="readiness/1; - = standard output"
)
def command(config: Path, *, warm_up: float, values: tuple[str, ...], json_file: str | None) -> int:
    """Check whether the bench is ready, without a truck on the drum.

    The bench stands, turns slowly, and then warms up at one speed. The run begins when the operator
    switches the PLC to remote; Ctrl-C ramps down. The values are appended to readiness.csv in the
    folder of the recordings.

    Exit code 0: every value lies within its limit; 1: one does not, or the run did not come to its
    end.
    """
    from gateway import config_file
    from gateway.workflows.ready import ready

    settings = config_file.with_values(config_file.load(config), assignments(values))
    found = ready(
        settings,
        warm_up=warm_up,
        view=json_file != "-",
        report=partial(click.echo, err=True),
    )
    if json_file is not None:
        write_json(json_file, found.to_json(), indent=2)
    if json_file != "-":
        click.echo(str(found))
    return 0 if found.holds else 1
