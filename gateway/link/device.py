"""A live device for the operator's commands: connect, read and write registers, disconnect."""

import math
import ssl
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Final

from gateway.errors import ConfigError
from gateway.link.inspection import Reading, Words, mbpoll
from gateway.link.plc import READ_HOLDING, READ_INPUT, LinkError, TcpLink
from gateway.reasons import Reason
from register_maps.codec import CodecError, decode_value, encode_value, scaled
from register_maps.register_map import Block, Register, RegisterMap
from register_maps.signals import RESERVED, SIGNALS
from register_maps.units import UNITS

POLL: Final = 0.002
REFUSED: Final = frozenset({Reason.EXCEPTION_1, Reason.EXCEPTION_2, Reason.EXCEPTION_3})
"""Answers to a block with an address that the device does not have."""
VERIFY_PAUSE: Final = 0.15
"""[s] Time between the two readings of `verify`: many scans of a PLC."""


@contextmanager
def open_link(
    host: str, port: int, unit: int, timeout: float, tls: ssl.SSLContext | None = None
) -> Iterator[TcpLink]:
    """Connected link, for a command that may wait. Raises LinkError after `timeout` [s]."""
    link = TcpLink(host, port, unit, timeout, inspects=True, tls=tls)
    deadline = time.monotonic() + timeout
    try:
        while not _connects(link, deadline):
            time.sleep(POLL)
        yield link
    finally:
        link.close()


def _connects(link: TcpLink, deadline: float) -> bool:
    try:
        link.connect()
    except LinkError:
        if time.monotonic() > deadline:
            raise
        return False
    return True


@dataclass(frozen=True, kw_only=True)
class Device:
    """Address of a device; timeout : of a request [s]; tls : context of gateway.link.tls."""

    host: str
    port: int
    unit: int
    timeout: float
    tls: ssl.SSLContext | None = None

    @contextmanager
    def link(self) -> Iterator[TcpLink]:
        """Connected link to the device."""
        with open_link(self.host, self.port, self.unit, self.timeout, self.tls) as link:
            yield link

    def mbpoll(self, register: Register, words: Words | None = None) -> str:
        """Call of mbpoll that reads the register, or writes these words to it."""
        return mbpoll(register, self.host, self.port, self.unit, writing=words)


def two_readings(device: Device, register_map: RegisterMap) -> list[Reading]:
    """Two readings of all registers, many scans apart."""
    with device.link() as link:
        first = read_all(link, register_map)
        time.sleep(VERIFY_PAUSE)
        return [first, read_all(link, register_map)]


def round_trips(device: Device, block: Block, count: int = 100) -> list[float]:
    """Times of so many readings of a block, sorted [s]. Raises LinkError."""
    times = []
    with device.link() as link:
        for _ in range(count):
            begun = time.monotonic()
            _read(link, block)
            times.append(time.monotonic() - begun)
    return sorted(times)


def read_all(link: TcpLink, register_map: RegisterMap) -> Reading:
    """Words of each register, or why it cannot be read.

    Blocks are read whole. A refused block is halved until the refused registers stand alone.
    """
    reading: dict[str, Words | str] = {}
    for block in (register_map.measurement, register_map.command):
        inside = [register for register in register_map.registers if block.holds(register)]
        reading |= _read_together(link, block, inside)
    for register in register_map.registers:
        if register.name not in reading:
            reading[register.name] = _alone(link, register)
    return reading


def _read_together(
    link: TcpLink, block: Block, inside: Sequence[Register]
) -> dict[str, Words | str]:
    """Words of the registers of a block by one request, or by halves where that is refused."""
    try:
        link.connect()
        words = _read(link, block)
    except LinkError as error:
        if len(inside) == 1 or error.reason not in REFUSED:
            return {register.name: str(error) for register in inside}
        middle = len(inside) // 2
        halves = (inside[:middle], inside[middle:])
        return {
            name: found
            for half in halves
            for name, found in _read_together(link, _around(half), half).items()
        }
    return {register.name: _part(words, block, register) for register in inside}


def _around(registers: Sequence[Register]) -> Block:
    """Smallest block that holds registers of one table, given by rising address."""
    first, last = registers[0], registers[-1]
    return Block(table=first.table, start=first.address, count=last.end - first.address)


def _read(link: TcpLink, block: Block) -> Words:
    return link.read(
        block.start, block.count, READ_INPUT if block.table == "input" else READ_HOLDING
    )


def _part(words: Words, block: Block, register: Register) -> Words:
    return words[register.address - block.start : register.end - block.start]


def _alone(link: TcpLink, register: Register) -> Words | str:
    block = Block(table=register.table, start=register.address, count=register.raw.words)
    try:
        link.connect()
        return _read(link, block)
    except LinkError as error:
        return str(error)


def write_value(link: TcpLink, register: Register, words: Words) -> Words:
    """Write one register by function code 6 or 16; return the words that it then reads."""
    if len(words) == 1:
        link.write_one(register.address, words[0])
    else:
        link.write(register.address, words)
    return link.read(register.address, len(words))


def writable(register_map: RegisterMap, name: str) -> Register:
    """Register of this name. Raises ConfigError where the map has no such writable register."""
    allowed = {
        found.name: found
        for found in register_map.registers
        if found.access == "write" and found.signal != RESERVED
    }
    if name not in allowed:
        raise ConfigError(
            "no register that may be written",
            place=register_map.name,
            value=name,
            expected=f"one of {', '.join(allowed)}",
        )
    return allowed[name]


def parse_value(register: Register, text: str) -> float:
    """Value in the register's unit: a number, or names of bits or of a state joined by `+`.

    Raises ConfigError for any other text.
    """
    with suppress(ValueError):
        return float(text)
    members = getattr(SIGNALS[register.signal].type, "__members__", {})
    names = [name.strip().upper().replace("-", "_") for name in text.split("+")]
    if members and names == ["NONE"] and register.type == "bits":
        return 0.0
    if not members or set(names) - set(members) or (register.type != "bits" and len(names) > 1):
        expected = ", ".join(name.lower() for name in members)
        raise ConfigError(
            "no value of this register",
            place=register.name,
            value=text,
            expected=f"a number, or {expected}" if expected else "a number",
        )
    return float(sum(int(members[name]) for name in set(names)))


def encode_scaled(register: Register, scaled_value: float) -> Words:
    """Words of a value in the register's unit. Raises ConfigError for a value out of range."""
    value = UNITS[register.unit].to_si(scaled_value)
    if SIGNALS[register.signal].type is not float and not value.is_integer():
        raise ConfigError(
            "not whole", place=register.name, value=scaled_value, expected="a whole number"
        )
    try:
        return encode_value(register, int(value) if value.is_integer() else value)
    except CodecError as error:
        raise ConfigError(
            error.kind, place=register.name, value=scaled_value, expected=error.allowed
        ) from error


def is_exact(register: Register, words: Words, scaled_value: float) -> bool:
    """Whether the words hold exactly this value, and not only the nearest possible one."""
    value = decode_value(register, words)
    return value is not None and math.isclose(
        scaled(register, value), scaled_value, rel_tol=1e-9, abs_tol=1e-9
    )
