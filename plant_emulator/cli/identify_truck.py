"""Identify a truck's road load and gear efficiency from logs of its torque and velocity."""

from __future__ import annotations

from pathlib import Path

import click

from plant_emulator.cli import _options
from plant_emulator.model.dimensions import DRUM_RADIUS, TRUCK_RATIO, WHEEL_RADIUS
from register_maps.command_line.parameters import Command, Number, OutputFile

EXAMPLE = """
\b
Examples:
  plant-emulator identify-truck torque.csv.gz velocity.csv.gz --mass 3640 \\
      --save truck.toml --plot truck.png
  plant-emulator identify-truck --coast-down out.csv back.csv --mass 3640
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("torque")
@click.argument("velocity")
@click.argument("more", nargs=-1, metavar="[VELOCITY]...")
@click.option(
    "--coast-down",
    is_flag=True,
    help="All logs are VELOCITY: the truck rolls out by itself, in both directions.",
)
@click.option("--mass", type=Number(50, 1e5), required=True, metavar="KG", help="Mass with load.")
@click.option(
    "--ratio",
    type=Number(1, 1000),
    default=TRUCK_RATIO,
    show_default=True,
    help="Motor speed over wheel speed.",
)
@click.option(
    "--wheel-radius",
    type=Number(0.02, 2),
    default=WHEEL_RADIUS,
    show_default=True,
    metavar="M",
    help="Radius of the truck's drive wheel.",
)
@click.option(
    "--drum-radius",
    type=Number(0.05, 5),
    default=DRUM_RADIUS,
    show_default=True,
    metavar="M",
    help="Radius of the bench's drum: crr_v refers to the drum's speed.",
)
@click.option(
    "--gain-uncertainty",
    type=Number(1e-6, 1),
    default=0.02,
    show_default=True,
    metavar="FRACTION",
    help="Standard deviation of the load cell's gain from 1, from its calibration.",
)
@click.option(
    "--save", type=OutputFile(), help="Write the [truck] table of a gateway configuration."
)
@_options.plot
@_options.json_file
def command(
    torque: str,
    velocity: str,
    more: tuple[str, ...],
    *,
    coast_down: bool,
    mass: float,
    ratio: float,
    wheel_radius: float,
    drum_radius: float,
    gain_uncertainty: float,
    save: str | None,
    plot: str | None,
    json_file: str | None,
) -> None:
    """Identify a truck from its road logs TORQUE (time_s, motor_torque_Nm) and VELOCITY (time_s,
    velocity_m_s).

    Each log may have its own clock and sample rate. The road must be level. The run needs driving
    and braking by the motor, in both directions if possible. Exit code 1: the estimates must not be
    used.

    With --coast-down no load cell is needed: two VELOCITY logs or more, one roll-out each, the
    velocity negative in the other direction.
    """
    if coast_down:
        if plot:
            raise click.UsageError("--plot does not draw coast-downs")
        _coast_down((torque, velocity, *more), mass, drum_radius, save, json_file)
        return
    if more:
        raise click.UsageError(f"{more[0]}: only --coast-down takes more than two logs")
    from plant_emulator.errors import EmulatorError
    from plant_emulator.workflows.truck_identification import identify_truck

    found = identify_truck(
        torque,
        velocity,
        mass=mass,
        ratio=ratio,
        wheel_radius=wheel_radius,
        drum_radius=drum_radius,
        gain_uncertainty=gain_uncertainty,
    )
    if plot:
        found.plot(plot)
    if json_file:
        _options.write_json(found.to_json(), json_file)
    if json_file != "-":
        click.echo(str(found))
    if not found.converged:
        kept = f"; {save} is not written" if save else ""
        raise EmulatorError(
            f"{torque}, {velocity}: not converged: {'; '.join(found.problems)}{kept}"
        )
    if save:
        Path(save).write_text(found.truck_table(), encoding="utf-8")


def _coast_down(
    logs: tuple[str, ...],
    mass: float,
    drum_radius: float,
    save: str | None,
    json_file: str | None,
) -> None:
    """Identify the road load from coast-downs."""
    from plant_emulator.workflows.truck_identification import identify_coast_down

    found, origin = identify_coast_down(logs, mass=mass)
    if json_file:
        _options.write_json(found.to_json(drum_radius), json_file)
    if json_file != "-":
        click.echo(str(found))
    if save:
        Path(save).write_text(found.table(origin), encoding="utf-8")
