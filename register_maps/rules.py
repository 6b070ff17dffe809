"""Rules of a register map: first for each register alone, then for all registers together."""

from collections.abc import Sequence
from enum import IntEnum, IntFlag
from itertools import pairwise

from register_maps.conversion import as_signed, raw_limits
from register_maps.entry import Entry
from register_maps.register_map import Block, Register, TypeName
from register_maps.signals import RESERVED, SIGNALS, Signal
from register_maps.units import UNITS

Placed = Sequence[tuple[Register, Entry]]

_INTEGERS: tuple[TypeName, ...] = ("int16", "uint16", "int32", "uint32")


def check_register(entry: Entry, register: Register) -> None:
    """Refuse a register that contradicts itself or its signal. Raises MapError."""
    if register.scale == 0.0:
        raise entry.error("scale", "a number other than 0")
    signal = SIGNALS.get(register.signal)
    if signal is not None:
        _check_signal(entry, register, signal)
    elif register.type not in _INTEGERS:
        raise entry.error("type", f"one of {', '.join(_INTEGERS)}, since it means nothing")
    if register.access == "write" and register.table != "holding":
        raise entry.error("table", "holding, since an input register cannot be written")
    _check_range(entry, register)
    _check_counter(entry, register)
    if register.crc and (register.signal, register.type) != ("command_crc", "uint32"):
        raise entry.error("crc", "no crc, since only a command_crc of type uint32 can be one")


def _check_signal(entry: Entry, register: Register, signal: Signal) -> None:
    access = "read" if signal.kind == "measurement" else "write"
    if register.access != access:
        raise entry.error("access", f"{access}, since {signal.name} is a {signal.kind}")
    if register.si_unit.si != signal.unit:
        right = [unit for unit, conversion in UNITS.items() if conversion.si == signal.unit]
        raise entry.error("unit", f"a unit of {signal.name}: {', '.join(right)}")
    allowed = _types(signal)
    if register.type not in allowed:
        raise entry.error("type", f"a type that can carry {signal.name}: {', '.join(allowed)}")
    if issubclass(signal.type, int):
        for key, value, right_value in (
            ("scale", register.scale, 1),
            ("offset", register.offset, 0),
        ):
            if value != right_value:
                raise entry.error(key, f"{right_value}, since {signal.name} is not a quantity")


def _types(signal: Signal) -> tuple[TypeName, ...]:
    if issubclass(signal.type, IntFlag):
        return ("bits",)
    if issubclass(signal.type, IntEnum):
        return ("enum",)
    return (*_INTEGERS, "bits") if signal.type is int else (*_INTEGERS, "float32")


def _check_range(entry: Entry, register: Register) -> None:
    bounds = [(bound - register.offset) / register.scale for bound in register.range]
    held = f"{register.type} with scale {register.scale:g} and offset {register.offset:g}"
    digit = 0.0 if register.type == "float32" else 1e-6
    if min(bounds) < register.raw.low - digit or max(bounds) > register.raw.high + digit:
        ends = (
            raw * register.scale + register.offset for raw in (register.raw.low, register.raw.high)
        )
        low, high = sorted(ends)
        raise entry.error("range", f"inside {low:.10g} .. {high:.10g}, which {held} can hold")
    low, high = raw_limits(register)
    if register.constant is not None:
        if not register.range[0] <= register.constant <= register.range[1] or low > high:
            raise entry.error("constant", f"a value in the range that {held} can hold")
    elif low > high:
        raise entry.error("range", f"a range with at least one value of {held}")


def _check_counter(entry: Entry, register: Register) -> None:
    """Refuse a counter that is no integer or has ends between two, and a marker in the range."""
    digits = [(end - register.offset) / register.scale for end in register.range]
    if register.wraps and register.type not in _INTEGERS:
        raise entry.error("wraps", f"false, since only {', '.join(_INTEGERS)} wrap")
    if register.wraps and any(abs(digit - round(digit)) > 1e-6 for digit in digits):
        raise entry.error(
            "range", "two values of the counter, since it wraps from one to the other"
        )
    if register.not_available is None:
        return
    if register.type == "float32":
        raise entry.error("not_available", "no such key, since only an integer can have one")
    low, high = raw_limits(register)
    if low <= as_signed(register, register.not_available) <= high:
        raise entry.error("not_available", "a bit pattern outside the range")


def check_together(head: Entry, placed: Placed, measurement: Block, command: Block) -> None:
    """Refuse registers that overlap, repeat, leave a gap or do not fit the two requests.

    Raises MapError.
    """
    _check_blocks(head, measurement, command)
    _check_unique(placed)
    for register, entry in placed:
        block = measurement if register.access == "read" else command
        _check_inside(entry, register, block)
    _check_overlap(placed)
    _check_no_gap(head, placed, command)
    _check_complete(head, placed)
    for register, entry in placed:
        if register.crc and register.address == command.start:
            raise entry.error("crc", "at least one word before it in the command block")


def _check_blocks(head: Entry, measurement: Block, command: Block) -> None:
    apart = measurement.end <= command.start or command.end <= measurement.start
    if measurement.table == command.table and not apart:
        free = f"a block beside the measurement block {measurement.start} .. {measurement.end - 1}"
        raise head.error("command", free)


def _check_unique(placed: Placed) -> None:
    names: set[str] = set()
    signals: set[str] = set()
    for register, entry in placed:
        if register.name in names:
            raise entry.error("name", "a name that no other register has")
        if register.signal in signals:
            raise entry.error("signal", "a signal that no other register carries")
        names.add(register.name)
        signals.update({register.signal} - {RESERVED})


def _check_inside(entry: Entry, register: Register, block: Block) -> None:
    if block.holds(register):
        return
    name = "measurement" if register.access == "read" else "command"
    where = f"the {name} block {block.start} .. {block.end - 1} ({block.table})"
    if register.table != block.table:
        raise entry.error("table", f"{block.table}, to be in the one request of {where}")
    raise entry.error("address", f"the whole value in one request, that of {where}")


def _check_overlap(placed: Placed) -> None:
    by_address = sorted(placed, key=lambda pair: (pair[0].table, pair[0].address))
    for (before, _), (after, entry) in pairwise(by_address):
        if before.table == after.table and after.address < before.end:
            taken = f"{before.name} has {before.address} .. {before.end - 1}"
            raise entry.error("address", f"an address of its own: {taken}")


def _check_no_gap(head: Entry, placed: Placed, command: Block) -> None:
    """Refuse a written word without a register; a read word without one does no harm."""
    written = [register for register, _ in placed if register.access == "write"]
    named = {place for register in written for place in range(register.address, register.end)}
    for place in range(command.start, command.end):
        if place not in named:
            raise head.error("command", f"a register at address {place}, which is written too")


def _check_complete(head: Entry, placed: Placed) -> None:
    carried = {register.signal for register, _ in placed}
    missing = [
        signal.name for signal in SIGNALS.values() if signal.needed and signal.name not in carried
    ]
    if missing:
        raise head.error(None, f"also a register for {', '.join(missing)}")
