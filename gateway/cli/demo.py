"""Drive a forklift over the emulated bench, and show how much its drum feels like the road."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gateway.cli._shared.options import write_json
from register_maps.command_line.parameters import Command, Number, OutputFile
from register_maps.units import KMH

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rich.console import Console

    from gateway.offline.drive_quality import DriveQuality
    from gateway.offline.figures import CruiseForce, Latency, RunFigures

EXAMPLE = """
\b
Examples:
  gateway demo
  gateway demo --load 1600 --regulator thesis --period 20 --fast
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option(
    "--load",
    "load_mass",
    type=Number(0.0, 10000.0),
    metavar="KG",
    help="Load on the 3640 kg truck; default: a run without and a run with 1600 kg.",
)
@click.option(
    "--driver",
    type=click.Choice(["none", "pi"]),
    default="none",
    show_default=True,
    help="none replays the torque that the cycle takes on the road, pi holds the cycle's speed.",
)
@click.option("--regulator", default="compensated", show_default=True, metavar="NAME")
@click.option(
    "--torque",
    type=click.Choice(["integrated", "averaged", "instantaneous"]),
    default="integrated",
    show_default=True,
    help="Shaft torque that the regulator uses.",
)
@click.option(
    "--period",
    type=Number(10.0, 200.0),
    default=10.0,
    show_default=True,
    metavar="MS",
    help="Period of the gateway's loop.",
)
@click.option("--map", "map_name", default="bench_int16", show_default=True, metavar="NAME")
@click.option(
    "--bench-parameters",
    default="thesis_table_3_1",
    show_default=True,
    metavar="SET",
    help="Parameters of the emulated bench; the regulator keeps those of Table 3.1.",
)
@click.option(
    "--friction",
    metavar="FILE",
    help="Friction that the regulator compensates: a friction map or a parameter set.",
)
@click.option(
    "--duration",
    type=Number(1.0, 600.0),
    default=30.0,
    show_default=True,
    metavar="S",
    help="Duration of the truck's cycle.",
)
@click.option(
    "--repeats",
    type=click.IntRange(1, 100),
    default=1,
    show_default=True,
    metavar="N",
    help="Runs of each truck; the regulator `learned` remembers those before.",
)
@click.option("--fast", is_flag=True, help="Do not wait for a clock; latency is not measured.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("demo_output"),
    show_default=True,
    metavar="DIR",
    help="Folder for log, picture and summary.",
)
@click.option(
    "--json", "json_file", type=OutputFile(dash=True), help="Summary; - is standard output."
)
def command(
    *,
    load_mass: float | None,
    driver: str,
    regulator: str,
    torque: str,
    period: float,
    map_name: str,
    bench_parameters: str,
    friction: str | None,
    duration: float,
    repeats: int,
    fast: bool,
    out: Path,
    json_file: str | None,
) -> None:
    """Run the emulated bench, a forklift on its drum, and the gateway between them.

    There are three processes: the bench with its PLC behind Modbus TCP on 127.0.0.1, the gateway,
    and this one as the operator. The demo writes log, recording, configuration, demo.png and
    summary.json to DIR. Exit code 1: something other than the operator ended a run.
    """
    from rich.console import Console

    from gateway.demo.options import LOADS, DemoOptions
    from gateway.demo.run import demo
    from gateway.errors import GatewayError

    console = Console(stderr=json_file == "-")
    shown = demo(
        DemoOptions(
            loads=LOADS if load_mass is None else (load_mass,),
            driver=driver,
            regulator=regulator,
            torque=torque,
            period=period / 1e3,
            map=map_name,
            bench_parameters=bench_parameters,
            friction=friction,
            duration=duration,
            repeats=repeats,
            fast=fast,
            out=out,
        ),
        console,
    )
    _show(console, shown.figures, out)
    if json_file is not None:
        write_json(json_file, shown.to_json(), indent=2)
    if shown.failures:
        raise GatewayError("; ".join(shown.failures))


def _show(console: "Console", runs: "Sequence[RunFigures]", out: Path) -> None:
    """Print the key figures of all runs, one column a truck."""
    from rich.table import Table

    table = Table(title="Does the drum feel like the road?", title_justify="left")
    table.add_column("")
    for run in runs:
        table.add_column(f"{run.truck_mass:.0f} kg", justify="right")
    rows: tuple[tuple[str, Callable[[RunFigures], str]], ...] = (
        ("speed, Val1", lambda run: _percent(run.velocity.val1 if run.velocity else None)),
        ("speed, Val2", lambda run: _percent(run.velocity.val2 if run.velocity else None)),
        ("force in cruise, error", lambda run: _force(run.force)),
        ("traction energy, error", lambda run: _percent(_energy_error(run), sign="+")),
        ("J2951 inertia work, speed error", lambda run: _quality(run.quality)),
        ("shaft torque, from / to", lambda run: _torque(run.shaft_torque)),
        ("latency p50 / p99 / max", lambda run: _latency(run.latency)),
        ("missed deadlines", lambda run: f"{run.missed_deadlines} of {run.cycles}"),
        ("stopped by", lambda run: run.stop_reason),
    )
    for name, show in rows:
        table.add_row(name, *(show(run) for run in runs))
    console.print(table)
    console.print(f"picture, logs, recordings and summary.json: {out}", highlight=False)


def _percent(value: float | None, sign: str = "") -> str:
    return "-" if value is None else f"{value:{sign}.2f} %"


def _energy_error(run: "RunFigures") -> float | None:
    return run.energy.error_percent if run.energy else None


def _force(force: "CruiseForce | None") -> str:
    return "no cruise" if force is None else f"{force.mean_error:+.1f} N of {force.target:.0f} N"


def _torque(extremes: tuple[float, float] | None) -> str:
    return "-" if extremes is None else "{:+.1f} / {:+.1f} Nm".format(*extremes)


def _quality(quality: "DriveQuality | None") -> str:
    if quality is None:
        return "-"
    return f"{100.0 * quality.inertia_work:+.2f} %, {quality.speed_error / KMH:.3f} km/h"


def _latency(latency: "Latency | None") -> str:
    if latency is None:
        return "not measured"
    values = (latency.p50, latency.p99, latency.max)
    return " / ".join(f"{1e3 * value:.2f}" for value in values) + " ms"
