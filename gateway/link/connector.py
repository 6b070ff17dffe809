"""TCP connection without waiting: one attempt at a time, with a bounded back-off.

`poll` is called once a tick and returns at once. The constructor resolves a host name, because a
name server may take seconds. A name with several addresses is tried at one after the other. The
delay is 0.1 s after all of them have failed, and doubles up to 2 s; `note_success` resets it.
"""

import contextlib
import errno
import os
import select
import socket
import ssl
import time
from collections.abc import Callable
from typing import Final

from gateway.errors import ConfigError, PlcError
from gateway.link.tls import has_shaken_hands, wrap

FIRST_DELAY: Final = 0.1
LAST_DELAY: Final = 2.0
ATTEMPT_TIMEOUT: Final = 1.0
"""[s] Time-out of one attempt; it runs between ticks, never inside a tick."""
USER_TIMEOUT_MS: Final = 300
"""[ms] Bytes unacknowledged for longer end the connection, so that a pulled cable is noticed."""
KEEPALIVE: Final = ((socket.TCP_KEEPIDLE, 1), (socket.TCP_KEEPINTVL, 1), (socket.TCP_KEEPCNT, 3))


class Connector:
    """Opens TCP connections to one peer and never blocks.

    problem : why the last attempt failed; empty: it did not
    """

    def __init__(
        self,
        host: str,
        port: int,
        clock: Callable[[], float] = time.monotonic,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        self._addresses, self._turn = resolve(host, port), 0
        self._host, self._tls = host, tls
        self._clock = clock
        self._pending: socket.socket | None = None
        self._started = 0.0
        self._next_attempt = clock()
        self._delay = FIRST_DELAY
        self.problem = ""

    def poll(self) -> socket.socket | None:
        """Start or continue an attempt; return the connected socket, or None."""
        if self._pending is None and self._clock() >= self._next_attempt:
            self._start()
        return self._finish() if self._pending is not None else None

    def note_failure(self, delay: float | None = None) -> None:
        """Note that a connection ended. The next attempt waits for `delay` or the back-off [s]."""
        self._next_attempt = self._clock() + (self._delay if delay is None else delay)
        self._delay = min(2.0 * self._delay, LAST_DELAY)

    def note_success(self) -> None:
        """Note a good reply, which resets the back-off."""
        self._delay = FIRST_DELAY

    def close(self) -> None:
        """Abandon a pending attempt."""
        if self._pending is not None:
            self._pending.close()
            self._pending = None

    def _start(self) -> None:
        family, address = self._addresses[self._turn]
        attempt = socket.socket(family, socket.SOCK_STREAM)
        attempt.setblocking(False)
        self._pending, self._started = attempt, self._clock()
        error = attempt.connect_ex(address)
        if error not in (0, errno.EINPROGRESS):
            self._give_up(os.strerror(error))

    def _finish(self) -> socket.socket | None:
        """Connection whose attempt is over; None: it is under way, or has failed."""
        try:
            if not self._is_open():
                if self._clock() - self._started > ATTEMPT_TIMEOUT:
                    self._give_up(os.strerror(errno.ETIMEDOUT))
                return None
        except OSError as error:
            self._give_up(error.strerror or str(error))
            return None
        attempt, self._pending, self.problem = self._pending, None, ""
        return attempt

    def _is_open(self) -> bool:
        """Whether the attempt is over, its TLS handshake included. Raises OSError."""
        attempt = self._pending
        assert attempt is not None
        if isinstance(attempt, ssl.SSLSocket):
            return has_shaken_hands(attempt)
        if not select.select([], [attempt], [], 0.0)[1]:
            return False
        if error := attempt.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            raise OSError(error, os.strerror(error))
        set_options(attempt)
        if self._tls is not None:
            self._pending = wrap(attempt, self._tls, self._host)
        return self._tls is None

    def _give_up(self, problem: str) -> None:
        self.close()
        self.problem = problem
        self._turn = (self._turn + 1) % len(self._addresses)
        if self._turn == 0:
            self.note_failure()


Address = tuple[socket.AddressFamily, tuple[str, int]]


def resolve(host: str, port: int) -> list[Address]:
    """Address families and numeric addresses of a peer, in the order in which to try them.

    Raises ConfigError for an unknown host, PlcError for name servers that do not answer now.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, ValueError) as error:  # a ValueError for a text that cannot be a name
        if isinstance(error, socket.gaierror) and error.errno == socket.EAI_AGAIN:
            raise PlcError(
                f"{host}: {error.strerror}; expected a name server that answers"
            ) from error
        raise ConfigError(
            getattr(error, "strerror", None) or "cannot be a name",
            place="[plc] host",
            value=host,
            expected="an address, or a name that is known here",
        ) from error
    return [(family, (str(address[0]), int(address[1]))) for family, *_, address in found]


def set_options(connection: socket.socket) -> None:
    """Make a connection send at once, and notice a dead peer."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in KEEPALIVE:
        with contextlib.suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, option, value)
    with contextlib.suppress(OSError):
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, USER_TIMEOUT_MS)
