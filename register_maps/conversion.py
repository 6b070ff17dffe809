"""Conversion of one raw value to its SI value and back, with every possible refusal.

Raw values are compared with raw limits, so that a range holds exactly, without rounding.

A received float that is not finite or is subnormal is refused. A value to send that is smaller than
the smallest normal float becomes zero, which is the nearest value that may be sent.
"""

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from register_maps.register_map import LARGEST_FLOAT, Register
from register_maps.signals import SIGNALS

Value = int | float | None
Refusal = Literal[
    "range", "constant", "not finite", "not a state", "not available", "words", "checksum"
]

SMALLEST_NORMAL = 2.0**-126
BYTE_ORDER = {
    "ABCD": (0, 1, 2, 3),
    "CDAB": (2, 3, 0, 1),
    "BADC": (1, 0, 3, 2),
    "DCBA": (3, 2, 1, 0),
}


class CodecError(ValueError):
    """A value that is refused: its register, raw words, scaled value, and the allowed values."""

    exit_code = 1

    def __init__(
        self, *, register: str, raw: tuple[int, ...], value: object, allowed: str, kind: Refusal
    ) -> None:
        self.register, self.raw, self.value = register, raw, value
        self.allowed, self.kind = allowed, kind
        words = " ".join(f"0x{word:04X}" for word in raw)
        shown = f"{words} = {value}" if words else f"{value}"
        super().__init__(f"{register}: {kind}: {shown}, allowed {allowed}")


@dataclass(frozen=True, kw_only=True, slots=True)
class Conversion:
    """Prepared conversion of one register: SI value = raw gain + shift, for low <= raw <= high.

    make : type of flags or state that the raw integer becomes
    exact : the raw integer is the value
    needed : the gateway cannot work without the signal
    """

    register: Register
    signal: str
    low: float
    high: float
    gain: float
    shift: float
    make: Callable[[Any], Value] | None
    floating: bool
    exact: bool
    not_available: int | None
    needed: bool


def conversion(register: Register, *, bounded: bool) -> Conversion:
    """Prepare a register; bounded : by the range of the map, otherwise only by the raw type."""
    signal = SIGNALS.get(register.signal)
    bounded = bounded or register.constant is not None
    unit, marker = register.si_unit, register.not_available
    low, high = raw_limits(register) if bounded else (register.raw.low, register.raw.high)
    return Conversion(
        register=register,
        signal=register.signal,
        low=low,
        high=high,
        gain=register.scale * unit.factor,
        shift=register.offset * unit.factor + unit.shift,
        make=signal.type if signal and register.type in ("bits", "enum") else None,
        floating=register.type == "float32",
        exact=signal is None or signal.type is int,
        not_available=None if marker is None else as_signed(register, marker),
        needed=signal is not None and signal.needed,
    )


def raw_limits(register: Register) -> tuple[float, float]:
    """Lowest and highest raw value inside the register's range (one value for a constant).

    A limit that falls between two raw integers moves inwards; 1e-6 of a digit counts as rounding.
    """
    bounds = register.range if register.constant is None else (register.constant,) * 2
    low, high = sorted((bound - register.offset) / register.scale for bound in bounds)
    if register.type != "float32":
        return math.ceil(low - 1e-6), math.floor(high + 1e-6)
    return nearest_float32(low), nearest_float32(high)


def as_signed(register: Register, pattern: int) -> int:
    """Raw value with this bit pattern in the integer type of the register."""
    negative = register.raw.low < 0 and pattern > register.raw.high
    return pattern - (1 << (16 * register.raw.words)) if negative else pattern


def nearest_float32(value: float) -> float:
    """Float32 nearest to a value, which must not exceed the largest float32."""
    rounded: float = struct.unpack(">f", struct.pack(">f", value))[0]
    return rounded


def raw_words(register: Register, raw: float) -> tuple[int, ...]:
    """Words of a raw value in the word order of the register."""
    data, order = struct.pack(f">{register.raw.code}", raw), BYTE_ORDER[register.word_order]
    moved = bytes(data[order[place] % len(data)] for place in range(len(data)))
    return struct.unpack(f">{register.raw.words}H", moved)


def value_of(this: Conversion, raw: float) -> Value:
    """SI value of a raw value; None: not available. Raises CodecError."""
    if not this.low <= raw <= this.high:
        if raw == this.not_available and not this.needed:
            return None
        raise _refusal(this, raw)
    if this.make is not None:
        try:
            return this.make(raw)
        except ValueError:
            raise _refusal(this, raw, "not a state") from None
    if this.exact:
        return raw
    if this.floating and -SMALLEST_NORMAL < raw < SMALLEST_NORMAL and raw != 0.0:
        raise _refusal(this, raw, "not finite")
    return raw * this.gain + this.shift


def raw_of(this: Conversion, value: Value) -> float:
    """Raw value nearest to an SI value, a tie to the even one. Raises CodecError."""
    if this.register.constant is not None:
        return this.low
    if value is None:
        if this.not_available is None:
            raise _unsendable(this, value, "not available")
        return this.not_available
    wanted = value if this.exact else (value - this.shift) / this.gain
    if isinstance(wanted, float) and not math.isfinite(wanted):
        raise _unsendable(this, value, "not finite")
    raw = _float_raw(wanted) if this.floating else _integer_raw(this, wanted)
    if not this.low <= raw <= this.high:
        raise _unsendable(this, value, "range")
    return raw


def _integer_raw(this: Conversion, wanted: float) -> int:
    """Nearest integer; a counter starts again at the end of its range."""
    raw = round(wanted)
    if this.register.wraps:
        lowest, highest = int(this.low), int(this.high)
        return (raw - lowest) % (highest - lowest + 1) + lowest
    return raw


def _float_raw(wanted: float) -> float:
    """Nearest float32 that may be sent."""
    if abs(wanted) > LARGEST_FLOAT:
        return wanted
    raw = nearest_float32(wanted)
    return 0.0 if abs(raw) < SMALLEST_NORMAL else raw


def _refusal(this: Conversion, raw: float, kind: Refusal = "range") -> CodecError:
    """Error for a raw value that was received."""
    register = this.register
    if not math.isfinite(raw):
        kind = "not finite"
    elif raw == this.not_available:
        kind = "not available"
    elif register.constant is not None:
        kind = "constant"
    return CodecError(
        register=register.name,
        raw=raw_words(register, raw),
        value=f"{raw * register.scale + register.offset:.10g} {register.unit}",
        allowed=_allowed(this),
        kind=kind,
    )


def _unsendable(this: Conversion, value: Value, kind: Refusal) -> CodecError:
    """Error for an SI value that was to be sent."""
    register, shown = this.register, f"{value}"
    if value is not None and not this.exact:
        shown = f"{register.si_unit.from_si(value):.10g} {register.unit}"
    return CodecError(
        register=register.name, raw=(), value=shown, allowed=_allowed(this), kind=kind
    )


def _allowed(this: Conversion) -> str:
    register = this.register
    if register.type == "enum":
        states: Any = SIGNALS[register.signal].type
        return ", ".join(f"{state.value} {state.name}" for state in states)
    low, high = sorted(raw * register.scale + register.offset for raw in (this.low, this.high))
    digits = 7 if this.floating else 10
    limits = f"{low:.{digits}g}" if low == high else f"{low:.{digits}g} .. {high:.{digits}g}"
    return f"{limits} {register.unit}"
