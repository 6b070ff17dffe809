"""Words to SI values and back. A value out of range raises; nothing saturates or is truncated.

A block is decoded at once. Its words become bytes, a prepared permutation puts the bytes into the
order ABCD, a prepared `struct` separates the raw values, and each raw value is checked and
converted (`conversion.py`). The preparation is made once for a map, because decoding runs at every
tick.

The `range` of the map binds the gateway in both directions: it refuses measurements and setpoints
outside. On the PLC's side (`encode_measurement`, `decode_setpoint`) only the raw type binds,
because the PLC has limits of its own, and an emulated PLC must be able to send a wrong value. A
counter marked `wraps` may be given unwrapped; it starts again at the end of its range.
"""

import math
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from register_maps.conversion import (
    BYTE_ORDER,
    CodecError,
    Conversion,
    Refusal,
    Value,
    conversion,
    raw_of,
    value_of,
)
from register_maps.register_map import Block, Register, RegisterMap
from register_maps.signals import RESERVED, Measurement, Setpoint

__all__ = [
    "CodecError",
    "Refusal",
    "Value",
    "command_crc",
    "decode_measurement",
    "decode_setpoint",
    "decode_value",
    "difference",
    "encode_measurement",
    "encode_setpoint",
    "encode_value",
    "scaled",
]


@dataclass(frozen=True, kw_only=True, slots=True)
class _Plan:
    """A prepared block. `order` moves its bytes to ABCD and back: it is its own inverse."""

    name: str
    count: int
    words: struct.Struct
    values: struct.Struct
    order: tuple[int, ...] | None
    conversions: tuple[Conversion, ...]


def _layout(registers: Sequence[Register], block: Block) -> tuple[str, tuple[int, ...] | None]:
    """Format of `struct` for the block, and the order of its bytes (None: unchanged)."""
    code, order, at = ">", list(range(2 * block.count)), block.start
    for register in registers:
        first, size = 2 * (register.address - block.start), 2 * register.raw.words
        places = BYTE_ORDER[register.word_order]
        order[first : first + size] = [first + places[place] % size for place in range(size)]
        code += "x" * (2 * (register.address - at)) + register.raw.code
        at = register.end
    code += "x" * (2 * (block.end - at))
    return code, None if order == sorted(order) else tuple(order)


def _plan(name: str, registers: Sequence[Register], block: Block, *, bounded: bool) -> _Plan:
    code, order = _layout(registers, block)
    return _Plan(
        name=name,
        count=block.count,
        words=struct.Struct(f">{block.count}H"),
        values=struct.Struct(code),
        order=order,
        conversions=tuple(conversion(register, bounded=bounded) for register in registers),
    )


@lru_cache(maxsize=32)
def _measurement_plan(register_map: RegisterMap, *, bounded: bool) -> _Plan:
    block = register_map.measurement
    inside = [register for register in register_map.registers if block.holds(register)]
    return _plan("measurement block", inside, block, bounded=bounded)


@lru_cache(maxsize=32)
def _command_plan(register_map: RegisterMap, *, bounded: bool) -> _Plan:
    block = register_map.command
    inside = [register for register in register_map.registers if block.holds(register)]
    return _plan("command block", inside, block, bounded=bounded)


@lru_cache(maxsize=512)
def _register_plan(register: Register) -> _Plan:
    block = Block(table=register.table, start=register.address, count=register.raw.words)
    return _plan(register.name, [register], block, bounded=True)


def _reorder(plan: _Plan, data: bytes) -> bytes:
    return data if plan.order is None else bytes([data[place] for place in plan.order])


def _unpack(plan: _Plan, words: Sequence[int]) -> tuple[Any, ...]:
    try:
        data = plan.words.pack(*words)
    except struct.error as error:
        raise CodecError(
            register=plan.name,
            raw=(),
            value=f"{len(words)} words {list(words)}",
            allowed=f"{plan.count} words of 0 .. 65535",
            kind="words",
        ) from error
    return plan.values.unpack(_reorder(plan, data))


def _pack(plan: _Plan, raws: Sequence[float]) -> tuple[int, ...]:
    return plan.words.unpack(_reorder(plan, plan.values.pack(*raws)))


def _decode(plan: _Plan, words: Sequence[int]) -> dict[str, Any]:
    values = {
        this.signal: value_of(this, raw)
        for this, raw in zip(plan.conversions, _unpack(plan, words), strict=True)
    }
    values.pop(RESERVED, None)
    return values


def _encode(plan: _Plan, values: Mapping[str, Value]) -> tuple[int, ...]:
    return _pack(plan, [raw_of(this, values.get(this.signal)) for this in plan.conversions])


def decode_value(register: Register, words: Sequence[int]) -> Value:
    """SI value of one register (number, flags or state); None: not available. Raises CodecError."""
    plan = _register_plan(register)
    return value_of(plan.conversions[0], _unpack(plan, words)[0])


def encode_value(register: Register, value: Value) -> tuple[int, ...]:
    """Words of one register for an SI value; None: not available. Raises CodecError."""
    plan = _register_plan(register)
    return _pack(plan, (raw_of(plan.conversions[0], value),))


def decode_measurement(register_map: RegisterMap, words: Sequence[int]) -> Measurement:
    """Measurement in the words of the measurement block. Raises CodecError."""
    return Measurement(**_decode(_measurement_plan(register_map, bounded=True), words))


def encode_measurement(register_map: RegisterMap, measurement: Measurement) -> tuple[int, ...]:
    """Words of the measurement block on the PLC's side; constants are those of the map."""
    values = {RESERVED: 0, **vars(measurement)}
    return _encode(_measurement_plan(register_map, bounded=False), values)


def encode_setpoint(register_map: RegisterMap, setpoint: Setpoint) -> tuple[int, ...]:
    """Words of the command block; a map version or checksum of None is filled in.

    Raises CodecError.
    """
    values = {RESERVED: 0, **vars(setpoint)}
    if setpoint.map_version is None:
        values["map_version"] = register_map.version
    if setpoint.command_crc is None:
        values["command_crc"] = 0
    words = _encode(_command_plan(register_map, bounded=True), values)
    checked = _checksum_register(register_map)
    if checked is None or setpoint.command_crc is not None:
        return words
    first, after = _place(checked, register_map.command)
    return words[:first] + encode_value(checked, command_crc(words[:first])) + words[after:]


def decode_setpoint(register_map: RegisterMap, words: Sequence[int]) -> Setpoint:
    """Setpoint in the words of the command block; a checksum of 0 is not compared.

    Raises CodecError.
    """
    setpoint = Setpoint(**_decode(_command_plan(register_map, bounded=False), words))
    checked = _checksum_register(register_map)
    if checked is not None and setpoint.command_crc:
        first, after = _place(checked, register_map.command)
        expected = command_crc(words[:first])
        if setpoint.command_crc != expected:
            raise CodecError(
                register=checked.name,
                raw=tuple(words[first:after]),
                value=f"0x{setpoint.command_crc:08X}",
                allowed=f"0x{expected:08X}, or 0 for none",
                kind="checksum",
            )
    return setpoint


def _checksum_register(register_map: RegisterMap) -> Register | None:
    register = register_map.register("command_crc")
    return register if register is not None and register.crc is not None else None


def _place(register: Register, block: Block) -> tuple[int, int]:
    """Index of the register's first word in the block, and of the first word after it."""
    return register.address - block.start, register.end - block.start


def command_crc(words: Sequence[int]) -> int:
    """CRC-32 of zlib over the words, high byte first."""
    return zlib.crc32(struct.pack(f">{len(words)}H", *words))


def scaled(register: Register, value: float) -> float:
    """An SI value in the unit of the register, for the operator."""
    return register.si_unit.from_si(value)


def difference(now: float, before: float, modulus: float | None) -> float:
    """Difference `now - before` of a counter that may have wrapped at `modulus` (None: never).

    It is right while less than half a modulus lies between the two readings.
    """
    return now - before if modulus is None else math.remainder(now - before, modulus)
