"""A Modbus TCP peer of a few lines that answers, byte by byte, what a test tells it."""

import contextlib
import select
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

Answer = Callable[["Request"], bytes | None]
"""Bytes to send (none: stay silent); None hangs up."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """One request as it came: MBAP header, function code, data."""

    transaction: int
    unit: int
    function: int
    data: bytes

    @property
    def count(self) -> int:
        """Registers asked for: bytes 2 and 3 of the data of FC3, FC4 and FC16."""
        return int.from_bytes(self.data[2:4], "big")


@dataclass
class Peer:
    """A listening peer; `requests`: what it was asked, `connections`: how often called."""

    answer: Answer
    listener: socket.socket
    requests: list[Request] = field(default_factory=list)
    connections: int = 0

    @property
    def port(self) -> int:
        """Where it listens, on 127.0.0.1."""
        return int(self.listener.getsockname()[1])


def frame(transaction: int, unit: int, pdu: bytes, protocol: int = 0) -> bytes:
    """A frame: transaction id, protocol id, length of what follows, unit id, PDU; big-endian."""
    return struct.pack(">HHHB", transaction, protocol, len(pdu) + 1, unit) + pdu


def normal(request: Request) -> bytes:
    """The reply of a well-behaved PLC in which register n holds 100 + n."""
    start = int.from_bytes(request.data[:2], "big")
    if request.function in (3, 4):
        words = [100 + start + offset for offset in range(request.count)]
        pdu = struct.pack(f">BB{len(words)}H", request.function, 2 * len(words), *words)
    else:
        pdu = (
            bytes([request.function]) + request.data[:4]
        )  # FC6: address, value; FC16: address, count
    return frame(request.transaction, request.unit, pdu)


@contextmanager
def peer(answer: Answer = normal) -> Iterator[Peer]:
    """A peer that runs in a thread while inside."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        running = Peer(answer=answer, listener=listener)
        ended = threading.Event()
        thread = threading.Thread(target=_serve, args=(running, ended))
        thread.start()
        try:
            yield running
        finally:
            ended.set()
            thread.join()


def _serve(running: Peer, ended: threading.Event) -> None:
    connections: list[socket.socket] = []
    while not ended.is_set():
        for ready in select.select([running.listener, *connections], [], [], 0.02)[0]:
            if ready is running.listener:
                connections.append(running.listener.accept()[0])
                running.connections += 1
            elif not _respond(running, ready):
                connections.remove(ready)
                ready.close()
    for connection in connections:
        connection.close()


def _respond(running: Peer, connection: socket.socket) -> bool:
    with contextlib.suppress(OSError):
        if received := connection.recv(300):
            transaction, _, _, unit = struct.unpack_from(">HHHB", received)
            request = Request(
                transaction=transaction, unit=unit, function=received[7], data=received[8:]
            )
            running.requests.append(request)
            reply = running.answer(request)
            if reply is not None:
                connection.sendall(reply)
                return True
    return False
