"""Check configuration, register map, loop stability and aliasing before any start."""

from pathlib import Path

import click

from gateway.cli._shared.options import assignments, write_json
from gateway.review.finding import Review
from gateway.workflows.check import check
from register_maps.command_line.parameters import Command, OutputFile

COLOURS = {"error": "red", "warning": "yellow", "info": "green"}

EXAMPLE = """
\b
Examples:
  gateway check -c bench.toml
  gateway check -c bench.toml --set truck.mass_kg=500 --set regulator.lead_s=0
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option("-c", "--config", type=click.Path(path_type=Path), required=True, help="TOML file")
@click.option("--live", is_flag=True, help="also compare the register map with the device")
@click.option(
    "--set", "values", multiple=True, metavar="KEY=VALUE", help="change a value of the file"
)
@click.option(
    "--json", "target", type=OutputFile(dash=True), help="machine-readable answer, - = stdout"
)
def command(config: Path, *, live: bool, values: tuple[str, ...], target: str | None) -> int:
    """Check a configuration before anything turns.

    Exit code 0: the configuration holds; 1: it does not; 2: bad input.
    """
    found = check(config, values=assignments(values), live=live)
    if target != "-":
        show(found)
    if target is not None:
        write_json(target, found.to_json(), indent=2)
    return 0 if found.holds else 1


def show(found: Review) -> None:
    """Print the findings for the operator, one a line."""
    for finding in found.findings:
        severity = click.style(f"{finding.severity:8}", fg=COLOURS[finding.severity])
        line = f"{finding.where}: {finding.what}: {finding.value}, allowed {finding.allowed}"
        click.echo(f"{severity}{line}")
    click.echo("holds" if found.holds else "does not hold")
