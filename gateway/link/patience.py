"""Patience with a PLC that is slow: at its first request, and with a request that we gave up.

Some PLCs answer the first request of a connection late, because they set the connection up then. So
one request is sent and waited for before any tick counts. Some PLCs die of a reply to a closed
connection. So a connection with an unanswered request is closed in our direction only, until the
PLC has closed it, too.

Nothing here blocks: each object is asked once a tick.
"""

import contextlib
import socket
from collections.abc import Callable
from typing import Final

from gateway.link.reply import HEADER, split
from gateway.link.tls import receive
from register_maps.register_map import Block

READ: Final = {"holding": 3, "input": 4}
TRANSACTION: Final = 0xFFFF
"""Transaction id of the first request; those of the client begin at 1."""
LINGER: Final = 1.0
"""[s] Time for which a given-up connection waits for the PLC to close it."""


def first_request(unit: int, block: Block) -> bytes:
    """Frame of a request that reads a block."""
    pdu = (
        bytes([READ[block.table]]) + block.start.to_bytes(2, "big") + block.count.to_bytes(2, "big")
    )
    return HEADER.pack(TRANSACTION, 0, len(pdu) + 1, unit) + pdu


class Settling:
    """A new connection whose first request waits for its reply.

    deadline : time until which it waits, by the clock of the link [s]
    """

    def __init__(self, connection: socket.socket, request: bytes, deadline: float) -> None:
        self.connection, self.deadline = connection, deadline
        self._received, self._request = b"", request
        connection.setblocking(False)

    def is_over(self) -> bool:
        """Whether a reply has come, be it good or not. Raises OSError for a closed connection.

        The first call sends the request.
        """
        if self._request:
            request, self._request = self._request, b""
            self.connection.sendall(request)
        chunk = receive(self.connection, 0.0)
        if chunk is None:
            return False
        if not chunk:
            raise ConnectionResetError(0, "closed by the peer before its first reply")
        self._received += chunk
        return bool(split(self._received)[0])


class Retired:
    """Connections that are given up, closed in our direction only."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._open: list[tuple[socket.socket, float]] = []

    def add(self, connection: socket.socket) -> None:
        """Give up a connection."""
        connection.setblocking(False)
        with contextlib.suppress(OSError):
            connection.shutdown(socket.SHUT_WR)
        self._open.append((connection, self._clock() + LINGER))

    def is_empty(self) -> bool:
        """Whether the PLC has closed all of them, or has had its time."""
        kept = []
        for connection, deadline in self._open:
            if self._clock() < deadline and not _has_ended(connection):
                kept.append((connection, deadline))
            else:
                connection.close()
        self._open = kept
        return not kept

    def close(self) -> None:
        """Close all of them at once."""
        for connection, _ in self._open:
            connection.close()
        self._open = []


def _has_ended(connection: socket.socket) -> bool:
    """Whether the PLC has closed the connection; what it still sends is dropped."""
    try:
        while connection.recv(4096):
            pass
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
