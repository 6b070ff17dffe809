"""Build a `RegisterMap` from the data of a map file. `rules.py` says what a map may not hold.

[map]
name, version, description
word_order = "ABCD"               default of the registers
measurement = {table, start, count}   the block that one request reads (FC3; FC4 from "input")
command     = {start, count}          the block that one request writes (FC16)

[[register]]
name         as in the PLC's list
signal       a field of `Measurement` or `Setpoint`, or "reserved"
table        "holding" or "input"
address      zero-based address of the first word, 0 .. 65535
type         int16, uint16, int32, uint32, float32, bits, enum
word_order   order of the bytes on the wire, A is the most significant: "ABCD", "CDAB" (low word
             first), "BADC" (bytes swapped inside each word), "DCBA" (both). A value of one word
             has its bytes swapped by the last two.
scale, offset  scaled value = raw * scale + offset (defaults 1 and 0)
unit         of the scaled value, a key of `units.UNITS`; it becomes the signal's SI unit
range        [lowest, highest] scaled value; outside it a measurement or setpoint is refused
access       "read" (in the measurement block) or "write" (in the command block)
description, source   what the register is; the document that says so
not_available  bit pattern that means "no value" (integers; outside the range)
constant     the only scaled value; any other value is refused
wraps        true: a counter that starts again at the end of its range
crc          "crc32": checksum over the words of the command block before this one
count        number of such registers in a row (only signal "reserved")
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, get_args

from register_maps.entry import Entry, Lines
from register_maps.register_map import (
    MOST_READ,
    MOST_WRITTEN,
    TYPES,
    Block,
    Register,
    RegisterMap,
    Table,
    WordOrder,
)
from register_maps.rules import check_register, check_together
from register_maps.signals import RESERVED, SIGNALS
from register_maps.units import UNITS

_MAP_KEYS = frozenset({"name", "version", "description", "word_order", "measurement", "command"})
_REGISTER_KEYS = frozenset(field.name for field in fields(Register)) | {"count"}
_ORDERS, _TABLES = get_args(WordOrder), get_args(Table)


def parse(data: Mapping[str, Any], *, file: str, lines: Lines, source_hash: str) -> RegisterMap:
    """Register map in the data of a file. Raises MapError."""
    root = Entry(values=data, table="", index=1, file=file, lines=lines)
    root.refuse_unknown(frozenset({"map", "register"}))
    head = _table(root, "map", data.get("map"), 1)
    head.refuse_unknown(_MAP_KEYS)
    default_order = head.choice("word_order", _ORDERS, "ABCD")
    rows = data.get("register")
    if not isinstance(rows, list) or not rows:
        raise root.error("register", "at least one [[register]]")
    entries = [_table(root, "register", row, index) for index, row in enumerate(rows, start=1)]
    placed = [pair for entry in entries for pair in _registers(entry, default_order)]
    measurement = _block(head, "measurement", MOST_READ)
    command = _block(head, "command", MOST_WRITTEN)
    check_together(head, placed, measurement, command)
    return RegisterMap(
        name=head.text("name"),
        version=head.integer("version", 0, 0xFFFF),
        description=head.text("description"),
        registers=tuple(sorted((register for register, _ in placed), key=_order)),
        measurement=measurement,
        command=command,
        source_hash=source_hash,
    )


def _order(register: Register) -> tuple[str, int]:
    return register.table, register.address


def _table(root: Entry, table: str, values: object, index: int) -> Entry:
    if not isinstance(values, dict):
        raise root.error(table, f"a table [{table}]")
    return Entry(values=values, table=table, index=index, file=root.file, lines=root.lines)


def _block(head: Entry, key: str, most: int) -> Block:
    value = head.values.get(key)
    keys = {"table", "start", "count"} if key == "measurement" else {"start", "count"}
    if not isinstance(value, dict) or not {"start", "count"} <= set(value) <= keys:
        raise head.error(key, f"a block: {{ {', '.join(sorted(keys, reverse=True))} }}")
    start, count = value["start"], value["count"]
    table = value.get("table", "holding")
    if type(start) is not int or type(count) is not int or table not in _TABLES:
        raise head.error(key, f"whole numbers; a table of {', '.join(_TABLES)}")
    if not 1 <= count <= most:
        raise head.error(key, f"a count of 1 .. {most}, which is what one request carries")
    if start < 0 or start + count > 0x10000:
        raise head.error(key, "addresses 0 .. 65535")
    return Block(table=table, start=start, count=count)


def _registers(entry: Entry, default_order: WordOrder) -> list[tuple[Register, Entry]]:
    """Register of an entry; several where `count` repeats a reserved register."""
    entry.refuse_unknown(_REGISTER_KEYS)
    register = _register(entry, default_order)
    check_register(entry, register)
    if "count" not in entry.values:
        return [(register, entry)]
    if register.signal != RESERVED:
        raise entry.error("count", "no count, since only reserved registers may be repeated")
    step, first = register.raw.words, register.address
    last = entry.integer("count", 1, (0x10000 - first) // step)
    places = [first + step * number for number in range(last)]
    names = [f"{register.name}_{place}" for place in places]
    return [
        (replace(register, name=name, address=place), entry)
        for name, place in zip(names, places, strict=True)
    ]


def _register(entry: Entry, default_order: WordOrder) -> Register:
    kind = entry.choice("type", tuple(TYPES))
    words = TYPES[kind].words
    has = entry.values.__contains__
    return Register(
        name=entry.text("name"),
        signal=_signal(entry),
        table=entry.choice("table", _TABLES),
        address=entry.integer("address", 0, 0x10000 - words),
        type=kind,
        word_order=entry.choice("word_order", _ORDERS, default_order),
        scale=entry.number("scale", 1.0),
        offset=entry.number("offset", 0.0),
        unit=entry.choice("unit", tuple(UNITS)),
        range=entry.pair("range"),
        access=entry.choice("access", ("read", "write")),
        description=entry.text("description"),
        source=entry.text("source"),
        not_available=_pattern(entry, words) if has("not_available") else None,
        constant=entry.number("constant") if has("constant") else None,
        wraps=entry.flag("wraps"),
        crc=entry.choice("crc", ("crc32",)) if has("crc") else None,
    )


def _signal(entry: Entry) -> str:
    signal = entry.values.get("signal")
    if signal != RESERVED and (not isinstance(signal, str) or signal not in SIGNALS):
        raise entry.error("signal", f"one of {', '.join(SIGNALS)}, {RESERVED}")
    return str(signal)


def _pattern(entry: Entry, words: int) -> int:
    return entry.integer("not_available", 0, (1 << (16 * words)) - 1)
