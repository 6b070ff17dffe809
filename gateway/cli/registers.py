"""Look at a register map on paper and on a live device: list, read, watch, verify, write."""

import json
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import click

import register_maps
from gateway.device import Device, encoded, read_all, two_readings, writable, write_value
from gateway.inspection import (
    Reading,
    Row,
    Words,
    constant_words,
    in_other_order,
    shown,
    swapped,
    verify,
)
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
    """Look at a register MAP (a shipped name or a TOML file), on paper and on a live device."""


def _on_a_device(wrapped: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        click.option("--timeout", default=1.0, show_default=True, help="for each request [s]"),
        click.option("--unit", default=1, show_default=True, help="unit id"),
        click.option("--port", default=5020, show_default=True, help="TCP port"),
        click.option("--host", default="127.0.0.1", show_default=True, help="address or name"),
        click.argument("name", metavar="MAP"),
    ):
        wrapped = option(wrapped)
    return wrapped


@command.command("list")
@click.argument("name", metavar="MAP")
def list_registers(name: str) -> None:
    """Print the map: addresses in both forms, types, orders, units, ranges."""
    rows = [_paper(register) for register in register_maps.load(name).registers]
    _table(
        ("name", "signal", "address", "form", "type", "order", "raw to", "range", "access"), rows
    )


def _paper(register: Register) -> tuple[str, ...]:
    low, high = register.range
    constant = "" if register.constant is None else f" = {register.constant:.10g} {_both(register)}"
    return (
        register.name,
        register.signal,
        f"{register.table} {register.address}",
        str(register.reference),
        register.type,
        register.word_order if register.raw.words > 1 else register.word_order[:2],
        f"{register.scale:g} {register.unit}"
        + (f" {register.offset:+g}" if register.offset else ""),
        f"{low:.10g} .. {high:.10g}{constant}",
        register.access,
    )


def _both(register: Register) -> str:
    """Words of a constant in its own order and with the words exchanged."""
    if register.raw.words == 1:
        return ""
    orders = (register.word_order, swapped(register.word_order))
    return ", ".join(f"{order} {_hex(constant_words(register, order))}" for order in orders)


@command.command()
@_on_a_device
def read(name: str, **where: Any) -> None:
    """Read every register once."""
    register_map, device = register_maps.load(name), Device(**where)
    with device.link() as link:
        reading = read_all(link, register_map)
        begun = time.monotonic()
    rows = [
        _live(register, reading[register.name], time.monotonic() - begun, device)
        for register in _meaning(register_map)
    ]
    _table(LIVE, rows)


LIVE: Final = (
    "name",
    "address",
    "raw",
    "value",
    "other order",
    "unit",
    "age",
    "the same with mbpoll",
)


def _live(register: Register, found: Words | str, age: float, device: Device) -> tuple[str, ...]:
    words = () if isinstance(found, str) else found
    return (
        register.name,
        f"{register.address} ({register.reference})",
        _hex(words),
        found if isinstance(found, str) else shown(register, found),
        in_other_order(register, words) if words else "",
        register.unit,
        f"{age * 1e3:.0f} ms",
        device.mbpoll(register),
    )


@command.command()
@click.option("--interval", default=0.5, show_default=True, help="between two readings [s]")
@click.option("--count", type=int, help="end after so many readings")
@_on_a_device
def watch(name: str, interval: float, count: int | None, **where: Any) -> None:
    """Print each register when it changes, with the time that it had been unchanged."""
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
            rows.append(_live(register, found, now - since, device))
    _table(LIVE, rows)


@command.command("verify")
@click.option("--json", "json_file", type=click.File("w"), help="register-map/1; - = stdout")
@_on_a_device
def verify_device(name: str, json_file: Any, **where: Any) -> int:
    """Compare the map with the device; exit code 1 when it does not hold."""
    register_map, device = register_maps.load(name), Device(**where)
    rows = verify(register_map, two_readings(device, register_map))
    holds = all(row.holds for row in rows)
    if json_file is not None:
        answer = {"schema": "register-map/1", "holds": holds, "registers": list(map(_entry, rows))}
        click.echo(json.dumps(answer), file=json_file)
    if json_file is None or json_file.name != "<stdout>":
        _table(FOUND, [_found(row, device) for row in rows])
        click.echo("the map holds" if holds else "the map does not hold")
    return 0 if holds else 1


FOUND: Final = (
    "name",
    "address",
    "raw",
    "value",
    "other order",
    "unit",
    "finding",
    "the same with mbpoll",
)


def _found(row: Row, device: Device) -> tuple[str, ...]:
    line = _live(row.register, row.words or row.finding, 0.0, device)
    return (*line[:6], ("" if row.holds else "! ") + row.finding, line[7])


def _entry(row: Row) -> dict[str, Any]:
    return {
        "name": row.register.name,
        "address": row.register.address,
        "raw": list(row.words),
        "value": row.value,
        "unit": row.register.unit,
        "finding": row.finding,
    }


@command.command(context_settings={"ignore_unknown_options": True})
@_on_a_device
@click.argument("register_name", metavar="REGISTER")
@click.argument("value", type=float)
@click.option("--yes", is_flag=True, help="do not ask")
def write(name: str, register_name: str, value: float, *, yes: bool, **where: Any) -> None:
    """Write VALUE (in the map's unit) to a REGISTER that the map lets one write."""
    register_map, device = register_maps.load(name), Device(**where)
    register = writable(register_map, register_name)
    words = encoded(register, value)
    click.echo(f"{register.name} = {value:g} {register.unit}: {_hex(words)} to {register.address}")
    click.echo(device.mbpoll(register, words))
    if not yes:
        click.confirm("write it", abort=True)
    with device.link() as link:
        back = write_value(link, register, words)
    click.echo(f"reads back {_hex(back)} = {shown(register, back)} {register.unit}")


def _meaning(register_map: RegisterMap) -> list[Register]:
    """Registers that mean something."""
    return [found for found in register_map.registers if found.signal != RESERVED]


def _hex(words: Sequence[int]) -> str:
    return " ".join(f"{word:04X}" for word in words)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print columns as wide as their widest entry; never wrapped, so that a line can be copied."""
    if not rows:
        return
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        click.echo("  ".join(cells).rstrip())
