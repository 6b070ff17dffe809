"""Turn the operator's remote switch of a serving emulator."""

import click

from register_maps.command_line.parameters import Command

EXAMPLE = """
\b
Examples:
  plant-emulator operator --remote on
  plant-emulator operator --remote off --port 15020
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option(
    "--remote", type=click.Choice(["on", "off"]), required=True, help="Position of the switch."
)
@click.option(
    "--port",
    default=5020,
    show_default=True,
    type=click.IntRange(1, 65535),
    help="Port of the emulator's Modbus server.",
)
def command(remote: str, port: int) -> None:
    """Turn the operator's remote switch of a serving emulator.

    Off and on again acknowledges a gateway in SAFE, and starts one that is ARMED.
    """
    from plant_emulator.emulator import operator_socket

    operator_socket.ask(port, do="remote", on=remote == "on")
    state = operator_socket.ask(port, do="status")["state"]
    click.echo(f"remote {remote}, PLC {state}")
