"""The bench's own friction at steady speeds: the map that the gateway compensates by."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gateway.cli._options import assignments
from register_maps.command_line.parameters import PICTURES, Command, Number, OutputFile

if TYPE_CHECKING:
    from gateway.configuration.config import Config
    from gateway.reports.losses import Losses

EXAMPLE = """
\b
Examples:
  gateway losses -c bench.toml --save friction_map.toml
  gateway losses program2.csv.gz --save friction_map.toml --csv losses.csv --plot losses.png
"""
PICTURE = OutputFile(endings=PICTURES, path_type=Path)
CONCERNS = ("loop.", "plc.", "limits.watchdog", "regulator.torque")
"""What of `gateway check` also holds for a run without a truck."""


class Speeds(click.ParamType[list[float]]):
    """Speeds in rpm, separated by commas."""

    name = "RPM,RPM,..."

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float]:
        """The numbers in the text."""
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
    help="each of them for so long; default: 8",
)
@click.option("--set", "values", multiple=True, metavar="KEY=VALUE", help="instead of the file's")
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
    """Measure what the bench itself takes at steady speeds, without a truck on the drum.

    Without a file: a sweep on the live bench, by the daemon and under its limits; it begins when
    the operator switches the PLC to remote, and ends by itself. With files: from the steady
    stretches in them. The map goes into `[regulator] friction` or `gateway demo --friction`.

    Exit code 1: the sweep did not come to its end; 2: the run does not show the friction.
    """
    from gateway import config_file
    from gateway.configuration.config import Config
    from gateway.reports import losses as report

    if files and (speeds is not None or hold is not None):
        raise click.UsageError("--speeds and --hold are for a live sweep; a file has had its own")
    if not files and config is None:
        raise click.UsageError("missing LOG|RECORDING, or -c CONFIG for a sweep on the live bench")
    settings = None
    if config is not None or values:
        settings = config_file.load(config) if config is not None else Config()
        settings = config_file.with_values(settings, assignments(values))
    if not files:
        assert settings is not None
        files = (_swept(settings, speeds, hold, quiet=json_file == "-"),)
    losses = found(files, settings)
    if json_file != "-":
        click.echo(report.summary(losses))
    if save is not None:
        save.write_text(report.toml(losses), encoding="utf-8")
    if table is not None:
        report.write_csv(table, losses)
    if plot is not None:
        report.draw(plot, losses)
    if json_file is not None:
        with click.open_file(json_file, "w", encoding="utf-8") as file:
            file.write(json.dumps(report.answer(losses), indent=2) + "\n")


def found(files: Sequence[Path], settings: "Config | None") -> "Losses":
    """The losses in files; the bench is that of `settings`, of a recording, or the thesis's."""
    from gateway.configuration.config import Config
    from gateway.losses.fit import fit as fit_friction
    from gateway.losses.sections import LeftOut, LossesError, Section, steady
    from gateway.recordings import steady_runs
    from gateway.reports import losses as report

    sources = [steady_runs.read(path) for path in files]
    sections: list[Section] = []
    left_out: list[LeftOut] = []
    for source in sources:
        known = settings or source.config or Config()
        try:
            held = steady(source.trace, known.bench, known.regulator.torque_offset)
        except LossesError as error:
            raise LossesError(f"{source.path}: {error}") from error
        sections += held.sections
        left_out += held.left_out
    try:
        fit = fit_friction(sections)
    except LossesError as error:
        why = "".join(f"; left out: {one.why}" for one in left_out)
        names = ", ".join(str(path) for path in files)
        raise LossesError(f"{names}: {error}{why}") from error
    return report.Losses(
        fit=fit,
        sections=sections,
        left_out=left_out,
        sources=[(source.path.name, source.date, source.sha256) for source in sources],
        bench=known.bench,
    )


def _swept(
    settings: "Config", speeds: list[float] | None, hold: float | None, *, quiet: bool
) -> Path:
    """The recording of a sweep on the live bench."""
    import register_maps
    from gateway.errors import ConfigError, GatewayError
    from gateway.losses.live import Progress, sweep_config
    from gateway.review import review
    from gateway.runtime import daemon

    config = sweep_config(settings, speeds, hold)
    register_map = register_maps.load(config.plc.map)
    for one in review.review(config, register_map):
        if one.severity == "error" and one.where.startswith(CONCERNS):
            raise ConfigError(
                one.what, place=one.where, value=str(one.value), expected=str(one.allowed)
            )
    assert config.sweep is not None
    progress = Progress(config.sweep)
    click.echo(
        f"no truck on the drum; {len(config.sweep.speeds)} speeds, "
        f"{config.sweep.duration:.0f} s from the moment in which the PLC is switched to remote",
        err=True,
    )
    ended = daemon.run(config, register_map, view=not quiet, over=progress)
    click.echo(f"recording: {ended.recording}", err=True)
    if not progress.done:
        why = ended.reason.text if ended.reason is not None else "stopped by the operator"
        raise GatewayError(f"the sweep did not come to its end: {why}; see {ended.recording}")
    return ended.recording
