"""Check that the bytes that came back are the reply to the request (pure).

A Modbus TCP frame is an MBAP header and a PDU. The header has transaction id, protocol id 0, length
and unit id (Modbus Messaging on TCP/IP Implementation Guide V1.0b, 3.1.3). The PDU has function
code and data, or function code + 0x80 and an exception code (Application Protocol V1.1b3, 7). One
request is outstanding at a time, so that exactly one frame may answer it. Late replies to abandoned
requests may stand before that frame, and nothing may follow it.
"""

import struct
from collections.abc import Set
from dataclasses import dataclass
from typing import Final, NamedTuple

from gateway.reasons import Reason

HEADER: Final = struct.Struct(">HHHB")
EXCEPTION_BIT: Final = 0x80


@dataclass(frozen=True, kw_only=True)
class Request:
    """Properties of a request that its reply must match."""

    transaction: int
    unit: int
    function: int
    length: int
    """[bytes] PDU of a normal reply."""


class Frame(NamedTuple):
    """One frame of the received bytes."""

    transaction: int
    protocol: int
    unit: int
    pdu: bytes


@dataclass(frozen=True, kw_only=True)
class Rejection:
    """Why received bytes are not the reply; exception : code of a Modbus exception."""

    reason: Reason
    text: str
    exception: int | None = None
    out_of_sync: bool = False
    """The rest of these bytes would be taken for the begin of the next reply."""


def split(received: bytes) -> tuple[list[Frame], bytes]:
    """Whole frames in the received bytes, and the bytes after them."""
    frames = []
    while len(received) >= HEADER.size:
        transaction, protocol, length, unit = HEADER.unpack_from(received)
        end = HEADER.size - 1 + length
        if length < 2 or len(received) < end:
            break
        frames.append(Frame(transaction, protocol, unit, received[HEADER.size : end]))
        received = received[end:]
    return frames, received


def check_reply(
    received: bytes, request: Request, abandoned: Set[int] = frozenset()
) -> Rejection | None:
    """Why these bytes are not the reply to the request; None: they are.

    abandoned : transaction ids of earlier requests whose replies may still come
    """
    frames, rest = split(received)
    frames = [frame for frame in frames if frame.transaction not in abandoned]
    if rest:
        return Rejection(
            reason=Reason.TIMEOUT, text=f"reply stops after {len(rest)} bytes", out_of_sync=True
        )
    if not frames:
        return Rejection(reason=Reason.TIMEOUT, text="no reply in time")
    if len(frames) > 1:
        return Rejection(
            reason=Reason.WRONG_TRANSACTION,
            text=f"{len(frames)} replies to one request",
            out_of_sync=True,
        )
    return _check_frame(frames[0], request)


def _check_frame(frame: Frame, request: Request) -> Rejection | None:
    function = frame.pdu[0]
    if (frame.transaction, frame.protocol, frame.unit) != (request.transaction, 0, request.unit):
        return Rejection(
            reason=Reason.WRONG_TRANSACTION,
            text=f"reply has transaction {frame.transaction}, protocol {frame.protocol}, "
            f"unit {frame.unit}; expected {request.transaction}, 0, {request.unit}",
        )
    if function == request.function | EXCEPTION_BIT and len(frame.pdu) == 2:
        return _exception(frame.pdu[1])
    if function != request.function:
        return Rejection(
            reason=Reason.WRONG_FUNCTION,
            text=f"reply has function code 0x{function:02x}, expected 0x{request.function:02x}",
        )
    if len(frame.pdu) != request.length:
        return Rejection(
            reason=Reason.WRONG_COUNT,
            text=f"reply has {len(frame.pdu)} bytes of PDU, expected {request.length}",
        )
    return None


def _exception(code: int) -> Rejection:
    reason = Reason.__members__.get(f"EXCEPTION_{code}")
    if reason is None:
        return Rejection(reason=Reason.WRONG_FUNCTION, text=f"exception {code}, expected 1 .. 11")
    return Rejection(reason=reason, text=reason.text, exception=code)
