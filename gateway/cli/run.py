"""The daemon: make the bench feel like the road, over Modbus TCP."""

from pathlib import Path

import click

import register_maps
from gateway import daemon
from gateway.cli._settings import assignments
from gateway.config_file import load, with_values

EXAMPLE = """
\b
Examples:
  gateway run -c bench.toml --shadow
  gateway run -c bench.toml
"""


@click.command(epilog=EXAMPLE)
@click.option("-c", "--config", type=click.Path(path_type=Path), required=True, help="TOML file")
@click.option("--shadow", is_flag=True, help="read and compute, write nothing")
@click.option("--duration", type=click.FloatRange(min=0.0), help="stop by itself after so long [s]")
@click.option("--set", "values", multiple=True, metavar="KEY=VALUE", help="instead of the file's")
def command(config: Path, *, shadow: bool, duration: float | None, values: tuple[str, ...]) -> int:
    """Run until Ctrl-C or SIGTERM: ramp down, hang up, keep the recording.

    Exit code 0: ended by the operator; 1: a fault of the PLC or of ours ended the last run, or the
    PLC was not there; 2: bad configuration.
    """
    settings = with_values(load(config), assignments(values))
    ended = daemon.run(
        settings, register_maps.load(settings.plc.map), shadow=shadow, duration=duration
    )
    click.echo(report(ended))
    return 0 if ended.reason is None else 1


def report(ended: daemon.Ended) -> str:
    """What is worth knowing afterwards."""
    times = "  ".join(f"{name} {value * 1e3:.2f} ms" for name, value in ended.latency.items())
    why = "by the operator" if ended.reason is None else f"{ended.reason.name}: {ended.reason.text}"
    return (
        f"ended {why}\n"
        f"{ended.cycles} ticks, {ended.missed} deadlines missed, {ended.dropped} records dropped\n"
        f"latency {times}\n"
        f"real time: {ended.real_time}\n"
        f"recording: {ended.recording}"
    )
