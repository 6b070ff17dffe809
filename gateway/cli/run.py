"""Run the daemon, which makes the bench feel like the road over Modbus TCP."""

import os
import shlex
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

import register_maps
from gateway.cli._shared.options import assignments
from gateway.config_file import load, with_values
from gateway.runtime import daemon
from register_maps.command_line.parameters import Command, Number

if TYPE_CHECKING:
    from gateway.review.finding import Finding

PATIENCE: Final = 3
"""[s] Time that a terminal may take for the report."""
EXAMPLE = """
\b
Examples:
  gateway run -c bench.toml --shadow
  gateway run -c bench.toml
  gateway run -c bench.toml --metrics 127.0.0.1:9108
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option("-c", "--config", type=click.Path(path_type=Path), required=True, help="TOML file")
@click.option("--shadow", is_flag=True, help="read and compute, write nothing")
@click.option("--duration", type=Number(min=0.0), help="stop after this time [s]")
@click.option(
    "--set", "values", multiple=True, metavar="KEY=VALUE", help="change a value of the file"
)
@click.option(
    "--log-format",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="form of the dated lines, one for each change of state or reason",
)
@click.option("--metrics", metavar="HOST:PORT", help="serve metrics, health and a page there")
def command(
    config: Path,
    *,
    shadow: bool,
    duration: float | None,
    values: tuple[str, ...],
    log_format: str,
    metrics: str | None,
) -> int:
    """Run until Ctrl-C or SIGTERM, then ramp down and close the recording.

    Exit code 0: the operator ended the run; 1: a fault of PLC or gateway ended it, or the PLC was
    not there; 2: bad configuration, also one that `gateway check` refuses. With --shadow a refused
    configuration only gives a warning, because nothing is written.
    """
    from gateway.review.review import review
    from gateway.workflows.run_quality import quality_at_the_end

    changes = assignments(values) | ({} if metrics is None else {"metrics.address": metrics})
    settings = with_values(load(config), changes)
    register_map = register_maps.load(settings.plc.map)
    found = review(settings, register_map)
    refused = list(map(_line, found.errors))
    for one in found.findings:
        if one.severity == "warning" and one.where.startswith("regulator."):
            click.echo(f"warning: {config}: {_line(one)}", err=True)
    check = shlex.join(["gateway", "check", "-c", str(config), *_repeat_option("--set", values)])
    for line in refused:
        click.echo(f"{'warning' if shadow else 'error'}: {config}: {line}; see {check}", err=True)
    if refused and not shadow:
        return 2
    ended = daemon.run(
        settings, register_map, shadow=shadow, duration=duration, log_format=log_format
    )
    code = 0 if ended.reason is None else 1
    _tell(report(ended), code)
    quality = quality_at_the_end(ended.recording)
    if quality is not None:
        _tell(f"SAE J2951, drum over demand: {quality}", code)
    return code


def _tell(text: str, code: int) -> None:
    """Write a text; a terminal that takes nothing does not keep this process from its end."""
    signal.signal(signal.SIGALRM, lambda *_: os._exit(code))
    signal.alarm(PATIENCE)
    click.echo(text)
    signal.alarm(0)


def _line(one: "Finding") -> str:
    """A finding of the review: place, value found, value expected."""
    return f"{one.where}: {one.what}: found {one.value}, expected {one.allowed}"


def _repeat_option(option: str, values: tuple[str, ...]) -> list[str]:
    return [word for value in values for word in (option, value)]


def report(ended: daemon.RunResult) -> str:
    """Lines for the operator after a run."""
    times = "  ".join(f"{name} {value * 1e3:.2f} ms" for name, value in ended.latency.items())
    why = "by the operator" if ended.reason is None else f"{ended.reason.name}: {ended.reason.text}"
    return (
        f"ended {why}\n"
        f"{ended.cycles} ticks, {ended.missed} deadlines missed, {ended.dropped} records dropped\n"
        f"latency {times}\n"
        f"real time: {ended.real_time}\n"
        f"recording: {ended.recording}"
    )
