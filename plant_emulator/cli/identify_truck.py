"""Find a truck's road load and gear efficiency from its torque and velocity on the road."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command, Number, OutputFile

if TYPE_CHECKING:
    from plant_emulator.road_load.answer import RoadAnswer

EXAMPLE = """
\b
Example:
  plant-emulator identify-truck torque.csv.gz velocity.csv.gz --mass 3640 \\
      --save truck.toml --plot truck.png
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("torque")
@click.argument("velocity")
@click.option("--mass", type=Number(50, 1e5), required=True, metavar="KG", help="With its load.")
@click.option(
    "--ratio", type=Number(1, 1000), default=14.0, show_default=True, help="Motor to wheel."
)
@click.option(
    "--wheel-radius", type=Number(0.02, 2), default=0.1715, show_default=True, metavar="M"
)
@click.option(
    "--drum-radius",
    type=Number(0.05, 5),
    default=0.645,
    show_default=True,
    metavar="M",
    help="Of the bench: crr_v goes with the drum's speed.",
)
@click.option(
    "--gain-uncertainty",
    type=Number(1e-6, 1),
    default=0.02,
    show_default=True,
    metavar="FRACTION",
    help="Standard deviation of the load cell's gain from 1, by its calibration.",
)
@click.option(
    "--save", type=OutputFile(), help="Write the [truck] table of a gateway configuration."
)
@_options.plot
@_options.json_file
def command(
    torque: str,
    velocity: str,
    mass: float,
    ratio: float,
    wheel_radius: float,
    drum_radius: float,
    gain_uncertainty: float,
    save: str | None,
    plot: str | None,
    json_file: str | None,
) -> None:
    """Fit the truck to its road logs TORQUE (time_s, motor_torque_Nm) and VELOCITY (time_s,
    velocity_m_s).

    Each log may have its own clock and rate. Level road; drive and brake through the motor, in
    both directions where possible. Exit code 1: the numbers must not be used.
    """
    from plant_emulator.errors import EmulatorError
    from plant_emulator.road_load.answer import answer
    from plant_emulator.road_load.fit import fit
    from plant_emulator.road_load.run import prepared
    from plant_emulator.road_load.signal import signal
    from plant_emulator.road_load.truck_model import Truck
    from plant_emulator.workflows import road_log

    truck = Truck(mass=mass, ratio=ratio, wheel_radius=wheel_radius, drum_radius=drum_radius)
    shown = signal(*road_log.read(torque, road_log.TORQUE), torque)
    driven = signal(*road_log.read(velocity, road_log.VELOCITY), velocity, rest=0.0)
    found = fit(prepared(shown, driven, truck), gain_uncertainty)
    said = answer(found)
    if plot:
        from plant_emulator.workflows.road_load_plot import draw

        draw(found, plot)
    if json_file:
        _options.write_json(said.as_json(), json_file)
    if json_file != "-":
        show(said)
    if not said.converged:
        kept = f"; {save} is not written" if save else ""
        raise EmulatorError(
            f"{torque}, {velocity}: not converged: {'; '.join(said.problems)}{kept}"
        )
    if save:
        from plant_emulator.road_load.truck_table import table
        from plant_emulator.workflows.road_log import origin

        with click.open_file(save, "w", encoding="utf-8") as file:
            file.write(table(said, truck, origin(torque, velocity)))


def show(said: RoadAnswer) -> None:
    """The answer for the operator."""
    click.echo(f"{'':24}{'value':>13}{'std. error':>12}{'95 % interval':>28}")
    for row in said.as_json().items():
        name, entry = row
        if isinstance(entry, dict) and "interval_95" in entry:
            low, high = entry["interval_95"]
            numbers = f"{entry['value']:13.6g}{entry['standard_error']:12.2g}"
            click.echo(f"{name:24}{numbers}{low:14.6g}{high:14.6g}  {entry['unit']}")
    click.echo(f"velocity: Val1 {said.velocity.val1:.2f} %, Val2 {said.velocity.val2:.2f} %")
    click.echo(f"{said.starts[0]} of {said.starts[1]} starts came to this optimum")
    for text in said.not_separable:
        click.echo(f"not separable: {text}")
