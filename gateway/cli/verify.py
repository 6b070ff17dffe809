"""Verify the emulated road on the live bench: losses, torque, inertia, coast-downs, response."""

from functools import partial
from pathlib import Path

import click

from gateway.cli._shared.options import assignments, write_json
from register_maps.command_line.parameters import Command, OutputFile

NAMES = ["losses", "torque", "inertia", "acceleration", "compensation", "coast-down", "response"]
EXAMPLE = """
\b
Examples:
  gateway verify -c bench.toml
  gateway verify -c bench.toml --only inertia --only losses --repeats 2
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("recording", metavar="[RECORDING]", type=click.Path(path_type=Path), required=False)
@click.option("-c", "--config", type=click.Path(path_type=Path), help="TOML file")
@click.option("--only", multiple=True, type=click.Choice(NAMES), help="a check; may be repeated")
@click.option(
    "--repeats",
    type=click.IntRange(1, 100),
    help="runs up and down at each rate, coast-downs of each truck (2 to 4); default: 5",
)
@click.option(
    "--set", "values", multiple=True, metavar="KEY=VALUE", help="change a value of the file"
)
@click.option(
    "--json", "json_file", type=OutputFile(dash=True), help="the values; - = standard output"
)
def command(
    recording: Path | None,
    config: Path | None,
    *,
    only: tuple[str, ...],
    repeats: int | None,
    values: tuple[str, ...],
    json_file: str | None,
) -> int:
    """Verify that the bench emulates the road, without a truck on the drum.

    The run begins when the operator switches the PLC to remote, and ends by itself; Ctrl-C ramps
    down. Each value stands beside its limit and the source of the limit. Limits "for comparison"
    were not read in the standard. The limits stand in [verification] of the configuration. With a
    RECORDING of an earlier verification, nothing turns.

    Exit code 1: a value lies outside, or the run did not come to its end.
    """
    from gateway import config_file
    from gateway.commissioning.verification import REPEATS
    from gateway.workflows.verify import evaluate_recording, verify

    if (recording is None) == (config is None):
        raise click.UsageError("expected -c CONFIG for a run on the live bench, or a RECORDING")
    if recording is not None and (values or repeats is not None):
        raise click.UsageError(
            "--set and --repeats are for a run on the live bench; a recording has had its own"
        )
    if recording is not None:
        found = evaluate_recording(recording, only)
    else:
        assert config is not None
        settings = config_file.with_values(config_file.load(config), assignments(values))
        found = verify(
            settings,
            only=only,
            repeats=repeats or REPEATS,
            view=json_file != "-",
            report=partial(click.echo, err=True),
        )
    if json_file is not None:
        write_json(json_file, found.to_json(), indent=2)
    if json_file != "-":
        click.echo(str(found))
    return 0 if found.holds else 1
