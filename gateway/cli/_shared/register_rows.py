"""The tables of `gateway registers`: their rows, and how a table is printed."""

from collections.abc import Sequence
from typing import Final

import click

from gateway.link.device import Device
from gateway.link.inspection import (
    RegisterRow,
    Words,
    constant_words,
    swap_words,
    value_in_other_order,
    value_text,
)
from register_maps.register_map import Register

PAPER: Final = (
    *("name", "signal", "address", "form", "type", "order", "raw to", "range", "access"),
    "with mbpoll",
)


def paper_row(register: Register, device: Device) -> tuple[str, ...]:
    """Row of a register in the map, with the call that reads it from a device."""
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
        device.mbpoll(register),
    )


def _both(register: Register) -> str:
    """Words of a constant in its word order and with the words exchanged; empty for one word."""
    if register.raw.words == 1:
        return ""
    orders = (register.word_order, swap_words(register.word_order))
    return ", ".join(f"{order} {in_hex(constant_words(register, order))}" for order in orders)


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


def live_row(register: Register, found: Words | str, age: float, device: Device) -> tuple[str, ...]:
    """Row of a register on a device; age : of the reading [s]."""
    words = () if isinstance(found, str) else found
    return (
        register.name,
        f"{register.address} ({register.reference})",
        in_hex(words),
        found if isinstance(found, str) else value_text(register, found),
        value_in_other_order(register, words) if words else "",
        register.unit,
        f"{age * 1e3:.0f} ms",
        device.mbpoll(register),
    )


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


def comparison_row(row: RegisterRow, device: Device) -> tuple[str, ...]:
    """Row of a register on a device, with the finding of the comparison."""
    line = live_row(row.register, row.words or row.finding, 0.0, device)
    return (*line[:6], ("" if row.holds else "! ") + row.finding, line[7])


def in_hex(words: Sequence[int]) -> str:
    """Words as four hexadecimal digits each."""
    return " ".join(f"{word:04X}" for word in words)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table without wrapping, so that a line can be copied."""
    if not rows:
        return
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        click.echo("  ".join(cells).rstrip())
