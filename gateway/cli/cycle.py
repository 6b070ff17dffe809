"""Show the energy of a truck over a travel cycle, from legs recorded on the bench."""

from pathlib import Path

import click

from gateway.cli._shared.options import write_json
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Examples:
  gateway cycle yard.toml
  gateway cycle yard.toml --json yard.json
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE")
@click.option(
    "--json", "json_file", type=OutputFile(dash=True), help="travel-cycle/1; - = standard output"
)
def command(file: Path, *, json_file: str | None) -> int:
    """Compute kWh/h, t/h and t/kWh of a travel cycle in the manner of VDI 2198.

    FILE (TOML) names the recordings of the legs, payload, cycles an hour, efficiency, recuperation
    and what the bench does not show, lifting for instance. The work at the wheel is measured; all
    else is input without a default. A leg in reverse is driven forward on the bench.

    Exit code 1: so many cycles do not fit into an hour.
    """
    from gateway.workflows.cycle import travel_cycle

    found = travel_cycle(file)
    if json_file is not None:
        write_json(json_file, found.to_json(), indent=2)
    if json_file != "-":
        click.echo(str(found))
    return 0 if found.fits else 1
