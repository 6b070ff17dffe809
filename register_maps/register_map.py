"""Records of a register map: registers, two blocks, and the error for a bad map.

`parse.py` reads a map from TOML and explains each key. `rules.py` says what a map may not hold.
`codec.py` turns words into values.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from register_maps.units import UNITS, Unit

Table = Literal["holding", "input"]
WordOrder = Literal["ABCD", "CDAB", "BADC", "DCBA"]
TypeName = Literal["int16", "uint16", "int32", "uint32", "float32", "bits", "enum"]
Access = Literal["read", "write"]

FIRST_REFERENCE = {"holding": 40001, "input": 30001}
MOST_READ, MOST_WRITTEN = 125, 123
LARGEST_FLOAT = 3.4028234663852886e38


@dataclass(frozen=True, kw_only=True)
class RawType:
    """Raw type: count of words, letter of `struct` (most significant byte first), and range."""

    words: int
    code: str
    low: float
    high: float


TYPES: dict[TypeName, RawType] = {
    "int16": RawType(words=1, code="h", low=-(2**15), high=2**15 - 1),
    "uint16": RawType(words=1, code="H", low=0, high=2**16 - 1),
    "int32": RawType(words=2, code="i", low=-(2**31), high=2**31 - 1),
    "uint32": RawType(words=2, code="I", low=0, high=2**32 - 1),
    "float32": RawType(words=2, code="f", low=-LARGEST_FLOAT, high=LARGEST_FLOAT),
    "bits": RawType(words=1, code="H", low=0, high=2**16 - 1),
    "enum": RawType(words=1, code="H", low=0, high=2**16 - 1),
}


class MapError(Exception):
    """A register map that cannot be used: file, line, value found and value expected."""

    exit_code = 2

    def __init__(self, *, file: str, line: int, place: str, value: object, expected: str) -> None:
        self.file, self.line, self.place = file, line, place
        self.value, self.expected = value, expected
        shown = " ".join(repr(value).split())
        super().__init__(f"{file}:{line}: {place} = {shown}: expected {expected}")


@dataclass(frozen=True, kw_only=True)
class Register:
    """One value in the memory of the PLC. Scaled value = raw value * scale + offset, in `unit`.

    address : zero-based address of the first word, as in a request
    range : lowest and highest scaled value
    not_available : raw value with which the PLC says that it has no value
    constant : the only scaled value that the register may hold
    wraps : the register is a counter that starts again at the end of its range
    crc : the register is a checksum over the words of the block before it
    """

    name: str
    signal: str
    table: Table
    address: int
    type: TypeName
    word_order: WordOrder
    scale: float
    offset: float
    unit: str
    range: tuple[float, float]
    access: Access
    description: str
    source: str
    not_available: int | None = None
    constant: float | None = None
    wraps: bool = False
    crc: Literal["crc32"] | None = None

    @property
    def raw(self) -> RawType:
        """Raw type of the register."""
        return TYPES[self.type]

    @property
    def si_unit(self) -> Unit:
        """Unit of the scaled value, with its factor to SI."""
        return UNITS[self.unit]

    @property
    def reference(self) -> int:
        """Number of the register in the 4xxxx (3xxxx) notation of data sheets."""
        return FIRST_REFERENCE[self.table] + self.address

    @property
    def end(self) -> int:
        """First address after the last word."""
        return self.address + self.raw.words


@dataclass(frozen=True, kw_only=True)
class Block:
    """Adjoining registers of one request."""

    table: Table
    start: int
    count: int

    @property
    def end(self) -> int:
        """First address after the last word."""
        return self.start + self.count

    def holds(self, register: Register) -> bool:
        """Whether the whole of the register lies inside."""
        return (
            register.table == self.table
            and self.start <= register.address
            and register.end <= self.end
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class RegisterMap:
    """One PLC: registers by address, a block to read and a block to write.

    Maps are compared by identity, so that the codec finds its prepared plan at once. Two maps have
    equal contents when `source_hash`, the SHA-256 of the file, is equal.
    """

    name: str
    version: int
    description: str
    registers: tuple[Register, ...]
    measurement: Block
    command: Block
    source_hash: str

    def register(self, signal: str) -> Register | None:
        """Register of a signal; None: the map has none."""
        return self._by_signal.get(signal)

    @cached_property
    def _by_signal(self) -> dict[str, Register]:
        """The first register of each signal; the tick asks for eleven of them."""
        return {register.signal: register for register in reversed(self.registers)}

    def modulus(self, signal: str) -> float | None:
        """Span after which a counter starts again [SI unit of the signal]; None: never."""
        register = self.register(signal)
        if register is None or not register.wraps:
            return None
        lowest, highest = register.range
        return (highest - lowest + abs(register.scale)) * register.si_unit.factor
