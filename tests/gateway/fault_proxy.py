"""A fault proxy: it passes requests on to a PLC, and spoils the replies as a test tells it."""

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tests.gateway.peer import Peer, Request, frame, peer

Toxic = Callable[[Request, bytes], bytes | None]
"""Bytes to send for a good reply (none: stay silent); None hangs up."""


def sound(_: Request, reply: bytes) -> bytes:
    """Pass the reply on as it is."""
    return reply


@dataclass
class Proxy:
    """A running proxy; `toxic` may be replaced at any moment."""

    listening: Peer
    toxic: Toxic = sound


@contextmanager
def proxy(port: int) -> Iterator[Proxy]:
    """Proxy in front of the PLC at a port of 127.0.0.1."""
    with socket.create_connection(("127.0.0.1", port)) as plc:
        plc.settimeout(10.0)

        def answer(request: Request) -> bytes | None:
            pdu = bytes([request.function]) + request.data
            plc.sendall(frame(request.transaction, request.unit, pdu))
            return running.toxic(request, whole_frame(plc))

        with peer(answer) as listening:
            running = Proxy(listening=listening)
            yield running


def whole_frame(connection: socket.socket) -> bytes:
    """The next frame that comes."""
    received = b""
    while len(received) < 6 or len(received) < 6 + int.from_bytes(received[4:6], "big"):
        chunk = connection.recv(4096)
        assert chunk, "the PLC has hung up"
        received += chunk
    return received
