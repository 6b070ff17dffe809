"""The operator's view of a register map, and its comparison with a device (pure).

A finding fails if no standing bench explains it: a register that cannot be read or is out of range,
a constant or a value that fits another word order only, a counter of the PLC's program that stands
still, a zero where a running PLC has none. A zero that a standing bench may show is a finding that
does not fail.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, get_args

from register_maps.codec import CodecError, decode_value, scaled
from register_maps.conversion import conversion, raw_words
from register_maps.register_map import Register, RegisterMap, WordOrder
from register_maps.signals import RESERVED

COUNTERS: Final = frozenset({"sequence_start", "plc_heartbeat", "plc_time", "sequence_end"})
NEVER_ZERO: Final = COUNTERS | {"status", "shell_temperature_1", "shell_temperature_2"}
MBPOLL_TYPES: Final = {"int32": ":int", "uint32": ":int", "float32": ":float"}
MBPOLL_TABLES: Final = {"holding": "4", "input": "3"}

Words = tuple[int, ...]
Reading = Mapping[str, Words | str]
"""Words of each register by its name, or why it could not be read."""


@dataclass(frozen=True, kw_only=True)
class RegisterRow:
    """One register as the device shows it.

    words : empty where the register cannot be read
    value : in the unit of the register; None where the words hold no value
    finding : what is wrong or unusual; empty: nothing
    """

    register: Register
    words: Words
    value: float | None
    finding: str
    holds: bool

    def to_json(self) -> dict[str, Any]:
        """Return the register as an entry of the document register-map/1."""
        return {
            "name": self.register.name,
            "address": self.register.address,
            "raw": list(self.words),
            "value": self.value,
            "unit": self.register.unit,
            "finding": self.finding,
        }


@dataclass(frozen=True, kw_only=True)
class MapVerification:
    """Comparison of a register map with a device, register by register."""

    rows: tuple[RegisterRow, ...]

    @property
    def holds(self) -> bool:
        """Whether the map holds for every register."""
        return all(row.holds for row in self.rows)

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as the document register-map/1."""
        registers = [row.to_json() for row in self.rows]
        return {"schema": "register-map/1", "holds": self.holds, "registers": registers}


def value_text(register: Register, words: Words) -> str:
    """Value in the register's unit as a text, or why there is none."""
    try:
        value = decode_value(register, words)
    except CodecError as error:
        return f"{error.value} ({error.kind})"
    if value is None:
        return "not available"
    if register.type == "bits":
        return str(value) if not hasattr(value, "name") else (value.name or "none")
    if register.type == "enum":
        return str(getattr(value, "name", value))
    return f"{scaled(register, value):.10g}"


def value_in_other_order(register: Register, words: Words) -> str:
    """Value as a text with the two words exchanged; empty for a register of one word."""
    if register.raw.words == 1:
        return ""
    return value_text(replace(register, word_order=swap_words(register.word_order)), words)


def swap_words(order: WordOrder) -> WordOrder:
    """Word order with the two words exchanged."""
    orders: dict[WordOrder, WordOrder] = {
        "ABCD": "CDAB",
        "CDAB": "ABCD",
        "BADC": "DCBA",
        "DCBA": "BADC",
    }
    return orders[order]


def constant_words(register: Register, order: WordOrder) -> Words:
    """Words of a constant in this word order."""
    placed = replace(register, word_order=order)
    return raw_words(placed, conversion(placed, bounded=True).low)


def mbpoll(
    register: Register, host: str, port: int, unit: int, *, writing: Words | None = None
) -> str:
    """Call of mbpoll that reads the register, or writes these words to it."""
    plain = (
        register.raw.words == 1 or writing is not None or register.word_order in ("BADC", "DCBA")
    )
    kind = MBPOLL_TABLES[register.table] + ("" if plain else MBPOLL_TYPES[register.type])
    first = "" if plain or register.word_order == "CDAB" else " -B"
    count = f" -c {register.raw.words if plain else 1}" if writing is None else ""
    values = "".join(f" {word}" for word in writing or ())
    return (
        f"mbpoll -q -1 -0 -a {unit} -r {register.address}{count} -t {kind}{first} "
        f"-p {port} {host}{values}"
    )


def verify(register_map: RegisterMap, readings: Sequence[Reading]) -> MapVerification:
    """Compare a map with two or more readings of a device that are some tens of ms apart."""
    return MapVerification(
        rows=tuple(
            _row(register, [reading[register.name] for reading in readings])
            for register in register_map.registers
            if register.signal != RESERVED
        )
    )


def _row(register: Register, seen: Sequence[Words | str]) -> RegisterRow:
    words = [found for found in seen if not isinstance(found, str)]
    if len(words) < len(seen):
        why = next(found for found in seen if isinstance(found, str))
        return RegisterRow(
            register=register, words=(), value=None, finding=f"unreadable: {why}", holds=False
        )
    finding = "" if register.access == "write" else _finding(register, words)
    return RegisterRow(
        register=register,
        words=words[-1],
        value=_value(register, words[-1]),
        finding=finding or _zero(register, words),
        holds=not finding,
    )


def _finding(register: Register, words: Sequence[Words]) -> str:
    refusals = (_refusal(register, found) for found in words)
    return next(filter(None, refusals), "") or _still(register, words)


def _refusal(register: Register, words: Words) -> str:
    """Why the words are no value of this register, and which word order would fit; empty: none."""
    try:
        decode_value(register, words)
    except CodecError as error:
        orders = [order for order in _other_orders(register) if _decodes(register, words, order)]
        if orders:
            return f"wrong word order: {register.word_order} gives {error.value}, {orders[0]} fits"
        return f"out of range: {error.value}, allowed {error.allowed}"
    return ""


def _other_orders(register: Register) -> tuple[WordOrder, ...]:
    orders: tuple[WordOrder, ...] = get_args(WordOrder)
    return orders if register.raw.words > 1 else orders[::2]


def _decodes(register: Register, words: Words, order: WordOrder) -> bool:
    try:
        decode_value(replace(register, word_order=order), words)
    except CodecError:
        return False
    return True


def _still(register: Register, words: Sequence[Words]) -> str:
    if len(words) > 1 and len(set(words)) == 1 and register.signal in COUNTERS:
        return "not moving: the PLC's program does not run, or this is not its counter"
    if register.signal in NEVER_ZERO and not any(map(any, words)):
        return "constant zero: a running PLC has another value here"
    return ""


def _zero(register: Register, words: Sequence[Words]) -> str:
    """Finding of a zero that a standing bench may show; empty: no zero."""
    numeric = register.type not in ("bits", "enum")
    if register.access == "read" and numeric and not any(map(any, words)):
        return "constant zero (as on a standing bench)"
    return ""


def _value(register: Register, words: Words) -> float | None:
    """Value in the register's unit; None where the words hold no value."""
    try:
        value = decode_value(register, words)
    except CodecError:
        return None
    return None if value is None else scaled(register, value)
