"""Show which cause keeps the bench of a recorded run from feeling like the road."""

from pathlib import Path

import click

from gateway.cli._shared.options import write_json
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Examples:
  gateway budget recordings/20261121T061045.260875Z.rlrec --parameters set.toml
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("recording", type=click.Path(path_type=Path), metavar="RECORDING")
@click.option(
    "--parameters",
    default="thesis_table_3_1",
    show_default=True,
    metavar="SET",
    help="parameter set of the digital twin: a shipped name or a file, as diagnose saves it",
)
@click.option(
    "--json", "json_file", type=OutputFile(dash=True), help="budget/1; - = standard output"
)
def command(recording: Path, *, parameters: str, json_file: str | None) -> None:
    """Repeat a run on the digital twin of its bench, with one cause at a time made ideal.

    The truck's wheel torque follows from the recorded sensors and the parameter set. The table
    shows how much force, energy and speed over the cycle are off from the road under the same
    torque: by each cause alone, by their interaction, and what no cause explains.
    """
    from gateway.twin.recorded import budget_of

    found = budget_of(recording, parameters)
    if json_file is not None:
        write_json(json_file, found.to_json(), indent=2)
    if json_file != "-":
        click.echo(str(found))
