"""List a register map, and read, watch, verify or write the registers of a live device."""

import time
from collections.abc import Callable
from typing import Any

import click

import register_maps
from gateway.cli._shared.options import write_json
from gateway.cli._shared.register_rows import (
    FOUND,
    LIVE,
    PAPER,
    comparison_row,
    in_hex,
    live_row,
    paper_row,
    table,
)
from gateway.errors import PlcError
from gateway.link.device import (
    Device,
    encode_scaled,
    is_exact,
    parse_value,
    read_all,
    two_readings,
    writable,
    write_value,
)
from gateway.link.inspection import Reading, Words, value_text, verify
from register_maps.command_line.parameters import LONGEST, Command, Number, OutputFile
from register_maps.register_map import Register, RegisterMap
from register_maps.signals import RESERVED

EXAMPLE = """
\b
Examples:
  gateway registers list bench_int16
  gateway registers watch bench_int16 --port 5020
  gateway registers verify bench_float32 --port 5020
"""


@click.group(epilog=EXAMPLE)
def command() -> None:
    """List a register MAP (shipped name or TOML file), and use it on a live device."""


def _on_a_device(wrapped: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        click.option(
            "--timeout",
            type=Number(0.0, LONGEST, min_open=True),
            default=1.0,
            show_default=True,
            help="time-out of each request [s]",
        ),
        click.option(
            "--unit", type=click.IntRange(0, 255), default=1, show_default=True, help="unit id"
        ),
        click.option(
            "--port",
            type=click.IntRange(1, 65535),
            default=5020,
            show_default=True,
            help="TCP port",
        ),
        click.option("--host", default="127.0.0.1", show_default=True, help="address or name"),
        click.argument("name", metavar="MAP"),
    ):
        wrapped = option(wrapped)
    return wrapped


@command.command("list")
@_on_a_device
def list_registers(name: str, **where: Any) -> None:
    """Print addresses in both notations, types, word orders, units, ranges and calls of mbpoll.

    Nothing is asked of a device; the options only go into the calls.
    """
    device = Device(**where)
    rows = [paper_row(register, device) for register in register_maps.load(name).registers]
    table(PAPER, rows)


@command.command()
@_on_a_device
def read(name: str, **where: Any) -> None:
    """Read every register once; exit code 1: no register answered."""
    register_map, device = register_maps.load(name), Device(**where)
    with device.link() as link:
        reading = read_all(link, register_map)
        begun = time.monotonic()
    rows = [
        live_row(register, reading[register.name], time.monotonic() - begun, device)
        for register in _meaning(register_map)
    ]
    table(LIVE, rows)
    if all(isinstance(found, str) for found in reading.values()):
        raise PlcError(
            f"{device.host}:{device.port}, unit {device.unit}: no register of {name} answered"
        )


@command.command()
@click.option(
    "--interval",
    type=Number(0.0, LONGEST),
    default=0.5,
    show_default=True,
    help="time between two readings [s]",
)
@click.option("--count", type=click.IntRange(1), help="end after so many readings")
@_on_a_device
def watch(name: str, interval: float, count: int | None, **where: Any) -> None:
    """Print each register that changes, and how long it was unchanged."""
    register_map, device = register_maps.load(name), Device(**where)
    seen: dict[str, tuple[Words | str, float]] = {}
    with device.link() as link:
        while count is None or count > 0:
            _changes(register_map, read_all(link, register_map), seen, device)
            count = None if count is None else count - 1
            time.sleep(interval)


def _changes(
    register_map: RegisterMap,
    reading: Reading,
    seen: dict[str, tuple[Words | str, float]],
    device: Device,
) -> None:
    now, rows = time.monotonic(), []
    for register in _meaning(register_map):
        found = reading[register.name]
        before, since = seen.get(register.name, (None, now))
        if found != before:
            seen[register.name] = (found, now)
            rows.append(live_row(register, found, now - since, device))
    table(LIVE, rows)


@command.command("verify", cls=Command)
@click.option("--json", "json_file", type=OutputFile(dash=True), help="register-map/1; - = stdout")
@_on_a_device
def verify_device(name: str, json_file: str | None, **where: Any) -> int:
    """Compare the map with the device; exit code 1: it does not hold."""
    register_map, device = register_maps.load(name), Device(**where)
    found = verify(register_map, two_readings(device, register_map))
    if json_file is not None:
        write_json(json_file, found.to_json())
    if json_file != "-":
        table(FOUND, [comparison_row(row, device) for row in found.rows])
        click.echo("the map holds" if found.holds else "the map does not hold")
    return 0 if found.holds else 1


@command.command(context_settings={"ignore_unknown_options": True})
@_on_a_device
@click.argument("register_name", metavar="REGISTER")
@click.argument("text", metavar="VALUE")
@click.option("--yes", is_flag=True, help="do not ask")
def write(name: str, register_name: str, text: str, *, yes: bool, **where: Any) -> None:
    """Write VALUE, in the unit of the map, to a writable REGISTER.

    VALUE is a number. A register of bits or states also takes names: enable, enable+fault_reset,
    none, road_load.
    """
    register_map, device = register_maps.load(name), Device(**where)
    register = writable(register_map, register_name)
    value = parse_value(register, text)
    words = encode_scaled(register, value)
    what = f"{register.name} = {value_text(register, words)} {register.unit}".rstrip()
    near = "" if is_exact(register, words, value) else f", nearest to {value:.10g}"
    click.echo(f"{what}{near}: {in_hex(words)} to {register.address}")
    click.echo(device.mbpoll(register, words))
    if not yes:
        click.confirm("write it", abort=True)
    with device.link() as link:
        back = write_value(link, register, words)
    click.echo(f"reads back {in_hex(back)} = {value_text(register, back)} {register.unit}")


def _meaning(register_map: RegisterMap) -> list[Register]:
    """Registers of the map that are not reserved."""
    return [found for found in register_map.registers if found.signal != RESERVED]
