"""Faults of a PLC or its network. Each fault is switched on by its name.

A fault acts in one of four places. Three have a function here: the image that the PLC publishes
(`image`), the bytes of a reply (`reply`), and the listening port (`refuses`). The functions do no
input or output: `image` returns words, `reply` returns timed chunks of bytes. The fourth place is
the PLC itself: RESTART happens once, after the scan in which the fault begins.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite

from plant_emulator.errors import EmulatorError
from register_maps.register_map import Register, RegisterMap

Words = tuple[int, ...]

IMAGE_FAULTS = ("frozen_heartbeat", "frozen_image", "nan", "torn_image", "word_order")
EXCEPTION_FAULTS = tuple(f"exception_{code}" for code in range(1, 12))
RESTART = "restart"
FRAME_FAULTS = ("wrong_function", "wrong_count", "wrong_transaction")
NAMES = (
    *IMAGE_FAULTS,
    *EXCEPTION_FAULTS,
    *FRAME_FAULTS,
    "late_reply",
    "drop_mid_reply",
    "refuse_connection",
    RESTART,
)

# [s] Longer than any sensible time-out of a 100 Hz client.
LATENESS = 0.15
# All bits set are a NaN in every word and byte order.
NOT_A_NUMBER = (0xFFFF, 0xFFFF)
NOT_AVAILABLE = -0x8000
HEADER = 7
READ_FUNCTIONS = range(1, 5)
READ_WRITE_FUNCTION = 23
WRITE_FUNCTION = 16
# Another function whose reply has the same shape, so that only the code tells them apart.
OTHER_FUNCTION = {3: 4, 4: 3, 6: 5, 16: 15, 23: 3}


class FaultError(EmulatorError):
    """A requested fault does not exist, or its start is no time."""

    exit_code = 2


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault's name and the PLC time at which it begins [s]."""

    name: str
    start: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Chunk:
    """Bytes that are sent `delay` seconds after the reply is ready; None: the connection closes."""

    delay: float = 0.0
    data: bytes | None


def parse(text: str) -> Fault:
    """Parse `NAME` or `NAME@SECONDS`. Raises FaultError."""
    name, _, start = text.partition("@")
    if name not in NAMES:
        raise FaultError(f"--fault {text}: unknown fault {name!r}; one of {', '.join(NAMES)}")
    return Fault(name=name, start=_seconds(text, start) if "@" in text else 0.0)


def _seconds(text: str, start: str) -> float:
    try:
        value = float(start)
    except ValueError:
        value = -1.0
    if not (isfinite(value) and value >= 0.0):
        raise FaultError(
            f"--fault {text}: start {start!r} must be a time of at least 0 s (NAME@SECONDS)"
        )
    return value


def active(faults: Iterable[Fault], now: float) -> frozenset[str]:
    """Names of the faults that have begun at PLC time `now` [s]."""
    return frozenset(fault.name for fault in faults if fault.start <= now)


def refuses(names: frozenset[str]) -> bool:
    """Whether the port is closed."""
    return "refuse_connection" in names


def refuses_requests(names: frozenset[str]) -> bool:
    """Whether every request gets an exception reply, and therefore has no effect."""
    return any(name in names for name in EXCEPTION_FAULTS)


def image(
    names: frozenset[str], register_map: RegisterMap, fresh: Words, previous: Words, shown: Words
) -> Words:
    """Words that the PLC publishes instead of `fresh`.

    previous : true image of the previous scan
    shown : published image of the previous scan, in which a frozen part stays
    """
    if "frozen_image" in names:
        return shown
    words = list(fresh)
    if "torn_image" in names:
        middle = len(words) // 2
        words[middle:] = previous[middle:]
    block = register_map.measurement
    for register in filter(block.holds, register_map.registers):
        _distort(names, register, words, block.start, shown)
    return tuple(words)


def _distort(
    names: frozenset[str], register: Register, words: list[int], start: int, shown: Words
) -> None:
    begin = register.address - start
    part = slice(begin, begin + register.raw.words)
    if "frozen_heartbeat" in names and register.signal == "plc_heartbeat":
        words[part] = shown[part]
    if "nan" in names and not register.signal.startswith("test_"):
        words[part] = _without_value(register) or words[part]
    if "word_order" in names:
        words[part] = words[part][::-1]


def _without_value(register: Register) -> tuple[int, ...]:
    """Words that mean "no number" in this register; empty if its type has no such value."""
    if register.type == "float32":
        return NOT_A_NUMBER
    if register.type == "int16":
        raw = NOT_AVAILABLE if register.not_available is None else register.not_available
        return (raw & 0xFFFF,)
    return ()


def reply(names: frozenset[str], frame: bytes) -> tuple[Chunk, ...]:
    """Chunks that are sent instead of a reply.

    frame : MBAP header (7 bytes), function code, data
    """
    delay = LATENESS if "late_reply" in names else 0.0
    frame = _alter(names, frame)
    if "drop_mid_reply" in names:
        return Chunk(delay=delay, data=frame[: len(frame) // 2]), Chunk(delay=delay, data=None)
    return (Chunk(delay=delay, data=frame),)


def _alter(names: frozenset[str], frame: bytes) -> bytes:
    for code, name in enumerate(EXCEPTION_FAULTS, start=1):
        if name in names:
            return _replace_pdu(frame, bytes([frame[HEADER] | 0x80, code]))
    if "wrong_count" in names:
        frame = _drop_register(frame)
    if "wrong_function" in names:
        other = OTHER_FUNCTION.get(frame[HEADER], frame[HEADER])
        frame = frame[:HEADER] + bytes([other]) + frame[HEADER + 1 :]
    if "wrong_transaction" in names:
        transaction = int.from_bytes(frame[:2], "big")
        frame = ((transaction + 1) & 0xFFFF).to_bytes(2, "big") + frame[2:]
    return frame


def _drop_register(frame: bytes) -> bytes:
    """Take the last register from a read reply; lower the count of a write reply by one."""
    function = frame[HEADER]
    if function in READ_FUNCTIONS or function == READ_WRITE_FUNCTION:
        count = frame[HEADER + 1]
        return _replace_pdu(frame, bytes([function, count - 2]) + frame[HEADER + 2 : -2])
    if function == WRITE_FUNCTION:
        count = int.from_bytes(frame[-2:], "big")
        return frame[:-2] + (count - 1).to_bytes(2, "big")
    return frame


def _replace_pdu(frame: bytes, pdu: bytes) -> bytes:
    """The frame with another protocol data unit; transaction and unit stay."""
    return frame[:4] + (len(pdu) + 1).to_bytes(2, "big") + frame[6:7] + pdu
