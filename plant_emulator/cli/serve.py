"""Emulate the bench and its PLC behind a Modbus TCP server."""

import asyncio
from pathlib import Path

import click

from register_maps.command_line.parameters import Command, Number, OutputFile

MASS_HELP = "Mass of the truck on the drum [kg], or none. The driver sets off in road-load."


class Mass(click.ParamType[float | None]):
    """A mass in kg, or `none`."""

    name = "KG|none"

    def convert(
        self,
        value: float | str | None,
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> float | None:
        """Mass [kg]; None for `none`."""
        if value is None or value == "none":
            return None
        try:
            mass = float(value)
        except ValueError:
            mass = 0.0
        if not 100.0 <= mass <= 100_000.0:
            self.fail(f"{value!r} is not a mass; 100 to 100000 (kg), or none", param, ctx)
        return mass


EXAMPLE = """
\b
Examples:
  plant-emulator serve
  plant-emulator serve --truck 5240 --remote-after 5 --log bench.csv
  plant-emulator serve --truck none --fault frozen_heartbeat@20
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option(
    "--port",
    default=5020,
    show_default=True,
    type=click.IntRange(0, 65535),
    help="Port; 0 takes any free one.",
)
@click.option("--map", "register_map", default="bench_int16", show_default=True, metavar="NAME")
@click.option(
    "--speed",
    default=1.0,
    show_default=True,
    type=Number(0.01, 1000.0),
    help="Emulated seconds per second.",
)
@click.option("--parameters", default="thesis_table_3_1", show_default=True, metavar="SET")
@click.option("--effect", multiple=True, metavar="NAME[:PARAM=VALUE,...]", help="May be repeated.")
@click.option("--fault", multiple=True, metavar="NAME[@SECONDS]", help="May be repeated.")
@click.option("--truck", default="3640", show_default=True, type=Mass(), help=MASS_HELP)
@click.option(
    "--driver",
    default="pi",
    show_default=True,
    type=click.Choice(["none", "pi"]),
    help="pi controls the speed of the drive cycle; none replays the torque of the cycle.",
)
@click.option("--remote/--local", default=False, help="Remote switch at the start.")
@click.option("--remote-after", type=Number(0.0), metavar="S", help="PLC time to turn remote on.")
@click.option("--log", type=OutputFile(path_type=Path), help="Log to write at the end.")
@click.option("--duration", type=Number(0.0), metavar="S", help="PLC time to stop at.")
@click.option("--control", is_flag=True, hidden=True, help="JSON requests on standard input.")
@click.option("--stepped", is_flag=True, hidden=True, help="Scan only on request.")
def command(
    host: str,
    port: int,
    register_map: str,
    speed: float,
    parameters: str,
    effect: tuple[str, ...],
    fault: tuple[str, ...],
    truck: float | None,
    driver: str,
    remote: bool,
    remote_after: float | None,
    log: Path | None,
    duration: float | None,
    control: bool,
    stepped: bool,
) -> None:
    """Emulate the bench and its PLC behind a Modbus TCP server.

    The first line of the output says where the server listens. Ctrl-C or SIGTERM ends the
    emulator, which then reports how well it kept real time.
    """
    from plant_emulator.emulator.emulator import Options
    from plant_emulator.emulator.serving import serve

    options = Options(
        host=host,
        port=port,
        map=register_map,
        speed=None if stepped else speed,
        parameters=parameters,
        effects=effect,
        faults=fault,
        truck_mass=truck,
        driver=driver,
        remote=remote,
        remote_after=remote_after,
        log=log,
        duration=duration,
        keeps_log=control,
    )
    timing = asyncio.run(serve(options, click.echo, control=control))
    click.echo(timing, err=True)
