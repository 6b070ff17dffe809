"""Whether the bytes that came back are the reply to what was asked (pure).

A Modbus TCP frame is the MBAP header (transaction id, protocol id 0, length, unit id; Modbus
Messaging on TCP/IP Implementation Guide V1.0b, 3.1.3) and a PDU: function code and data, or
function code + 0x80 and an exception code (Application Protocol V1.1b3, 7). One request is
outstanding at a time, so exactly one frame may answer it; in front of it may stand late replies to
requests that were given up, nothing may follow it.
"""

import struct
from collections.abc import Set
from dataclasses import dataclass
from typing import Final, NamedTuple

from gateway.reasons import Reason

HEADER: Final = struct.Struct(">HHHB")
EXCEPTION_BIT: Final = 0x80


@dataclass(frozen=True, kw_only=True)
class Asked:
    """One request, as far as its reply depends on it."""

    transaction: int
    unit: int
    function: int
    length: int
    """Bytes of the PDU of a normal reply."""


class Frame(NamedTuple):
    """One frame of a reply."""

    transaction: int
    protocol: int
    unit: int
    pdu: bytes


@dataclass(frozen=True, kw_only=True)
class Objection:
    """Why bytes are not the reply."""

    reason: Reason
    text: str
    exception: int | None = None
    out_of_step: bool = False
    """What is left of these bytes would come as the head of the next reply."""


def split(received: bytes) -> tuple[list[Frame], bytes]:
    """Whole frames, and what is left over."""
    frames = []
    while len(received) >= HEADER.size:
        transaction, protocol, length, unit = HEADER.unpack_from(received)
        end = HEADER.size - 1 + length
        if length < 2 or len(received) < end:
            break
        frames.append(Frame(transaction, protocol, unit, received[HEADER.size : end]))
        received = received[end:]
    return frames, received


def objection(received: bytes, asked: Asked, given_up: Set[int] = frozenset()) -> Objection | None:
    """What is wrong with these bytes as the reply, or None.

    given_up : transaction ids of earlier requests whose replies may still come
    """
    frames, rest = split(received)
    frames = [frame for frame in frames if frame.transaction not in given_up]
    if rest:
        return Objection(
            reason=Reason.TIMEOUT, text=f"reply stops after {len(rest)} bytes", out_of_step=True
        )
    if not frames:
        return Objection(reason=Reason.TIMEOUT, text="no reply in time")
    if len(frames) > 1:
        return Objection(
            reason=Reason.WRONG_TRANSACTION,
            text=f"{len(frames)} replies to one request",
            out_of_step=True,
        )
    return _frame_objection(frames[0], asked)


def _frame_objection(frame: Frame, asked: Asked) -> Objection | None:
    function = frame.pdu[0]
    if (frame.transaction, frame.protocol, frame.unit) != (asked.transaction, 0, asked.unit):
        return Objection(
            reason=Reason.WRONG_TRANSACTION,
            text=f"reply has transaction {frame.transaction}, protocol {frame.protocol}, "
            f"unit {frame.unit}; expected {asked.transaction}, 0, {asked.unit}",
        )
    if function == asked.function | EXCEPTION_BIT and len(frame.pdu) == 2:
        return _exception(frame.pdu[1])
    if function != asked.function:
        return Objection(
            reason=Reason.WRONG_FUNCTION,
            text=f"reply has function code 0x{function:02x}, expected 0x{asked.function:02x}",
        )
    if len(frame.pdu) != asked.length:
        return Objection(
            reason=Reason.WRONG_COUNT,
            text=f"reply has {len(frame.pdu)} bytes of PDU, expected {asked.length}",
        )
    return None


def _exception(code: int) -> Objection:
    reason = Reason.__members__.get(f"EXCEPTION_{code}")
    if reason is None:
        return Objection(reason=Reason.WRONG_FUNCTION, text=f"exception {code}, expected 1 .. 11")
    return Objection(reason=reason, text=reason.text, exception=code)
