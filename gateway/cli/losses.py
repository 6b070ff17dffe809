"""Measure the bench's own friction at steady speeds, and save the map that compensates it."""

import math
from functools import partial
from pathlib import Path

import click

from gateway.cli._shared.options import assignments, write_json
from register_maps.command_line.parameters import PICTURES, Command, Number, OutputFile

EXAMPLE = """
\b
Examples:
  gateway losses -c bench.toml --save friction_map.toml
  gateway losses program2.csv.gz --save friction_map.toml --csv losses.csv --plot losses.png
"""
PICTURE = OutputFile(endings=PICTURES, path_type=Path)


class Speeds(click.ParamType[list[float]]):
    """Speeds in rpm, separated by commas."""

    name = "RPM,RPM,..."

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float]:
        """Speeds in the text [rpm]."""
        try:
            found = [float(part) for part in value.split(",")]
        except ValueError:
            found = [math.nan]
        if not all(map(math.isfinite, found)):
            self.fail(f"{value!r}: expected numbers separated by commas", param, ctx)
        return found


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("files", metavar="[LOG|RECORDING]...", type=click.Path(path_type=Path), nargs=-1)
@click.option("-c", "--config", type=click.Path(path_type=Path), help="TOML file")
@click.option("--speeds", type=Speeds(), help="motor speeds of the sweep; default: 200 .. 4500")
@click.option(
    "--hold",
    type=Number(0.0, min_open=True),
    metavar="S",
    help="time for which each speed is held; default: 8",
)
@click.option(
    "--set", "values", multiple=True, metavar="KEY=VALUE", help="change a value of the file"
)
@click.option("--save", type=OutputFile(path_type=Path), help="write the friction map (TOML)")
@click.option("--csv", "table", type=OutputFile(path_type=Path), help="write the steady stretches")
@click.option("--plot", type=PICTURE, help="draw friction over speed (PNG)")
@click.option(
    "--json", "json_file", type=OutputFile(dash=True), help="losses/1; - = standard output"
)
def command(
    files: tuple[Path, ...],
    config: Path | None,
    *,
    speeds: list[float] | None,
    hold: float | None,
    values: tuple[str, ...],
    save: Path | None,
    table: Path | None,
    plot: Path | None,
    json_file: str | None,
) -> None:
    """Measure the friction of the bench itself at steady speeds, without a truck on the drum.

    Without a file: a sweep of speeds on the live bench under the limits of the daemon. It begins
    when the operator switches the PLC to remote, and ends by itself. With files: their steady
    stretches. The map goes into `[regulator] friction` or `gateway demo --friction`.

    Exit code 1: the sweep did not come to its end; 2: the run does not show the friction.
    """
    from gateway import config_file
    from gateway.configuration.config import Config
    from gateway.reports import losses as report
    from gateway.workflows.losses import measure_losses, run_sweep

    if files and (speeds is not None or hold is not None):
        raise click.UsageError("--speeds and --hold are for a live sweep; a file has had its own")
    if not files and config is None:
        raise click.UsageError("missing LOG|RECORDING, or -c CONFIG for a sweep on the live bench")
    settings = config_file.as_config(config or Config())
    settings = config_file.with_values(settings, assignments(values))
    if not files:
        to_operator = partial(click.echo, err=True)
        view = json_file != "-"
        files = (run_sweep(settings, speeds=speeds, hold=hold, view=view, report=to_operator),)
    losses = measure_losses(files, settings if config is not None or values else None)
    if json_file != "-":
        click.echo(report.summary(losses))
    if save is not None:
        save.write_text(report.toml(losses), encoding="utf-8")
    if table is not None:
        report.write_csv(table, losses)
    if plot is not None:
        report.draw(plot, losses)
    if json_file is not None:
        write_json(json_file, losses.to_json(), indent=2)
