"""Drive a program on the live bench; leave a recording and a log to identify or diagnose."""

import json
from functools import partial
from pathlib import Path

import click

from gateway.cli._shared.options import assignments, write_json
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Examples:
  gateway drive program1 -c bench.toml
  gateway drive next.csv -c bench.toml --repeats 3 --out runs
  plant-emulator diagnose runs/*.csv.gz --next-program next.csv
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("program", metavar="PROGRAM|FILE")
@click.option("-c", "--config", type=click.Path(path_type=Path), required=True, help="TOML file")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="folder for recording and log; default: that of the configuration",
)
@click.option(
    "--repeats",
    type=click.IntRange(1, 1000),
    default=1,
    show_default=True,
    help="times that the program is driven in a row",
)
@click.option(
    "--set", "values", multiple=True, metavar="KEY=VALUE", help="change a value of the file"
)
@click.option(
    "--json", "json_file", type=OutputFile(dash=True), help="drive/1; - = standard output"
)
def command(
    program: str,
    config: Path,
    *,
    out: Path | None,
    repeats: int,
    values: tuple[str, ...],
    json_file: str | None,
) -> int:
    """Drive a program without a truck on the drum, under the limits of the daemon.

    PROGRAM is program1 .. program4. FILE is CSV with time_s, speed_rpm (or speed_reference_rad_s as
    in a log) and optionally dwell_s, for which the speed of a row is held. The run begins when the
    operator switches the PLC to remote, and ends by itself; Ctrl-C ramps down.

    Exit code 1: the program did not come to its end; 2: it is none, or the limits would clip it.
    """
    from gateway import config_file
    from gateway.workflows.drive import drive, read_program

    changes: dict[str, str] = assignments(values)
    if out is not None:
        changes["recording.dir"] = json.dumps(str(out))
    settings = config_file.with_values(config_file.load(config), changes)
    to_operator = partial(click.echo, err=True)
    driven = drive(
        read_program(program, repeats), settings, view=json_file != "-", report=to_operator
    )
    if json_file is not None:
        write_json(json_file, driven.to_json(), indent=2)
    if json_file != "-":
        click.echo(f"recording: {driven.ended.recording}")
        if driven.log is not None:
            click.echo(f"log: {driven.log} ({driven.samples} samples)")
    if not driven.ended.completed:
        click.echo(f"error: {program} did not come to its end: {driven.ended.why}", err=True)
    return 0 if driven.ended.completed else 1
