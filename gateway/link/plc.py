"""The Modbus link to the PLC: the only module that knows pymodbus, and stricter than pymodbus.

pymodbus accepts a reply with a wrong function code or a wrong number of registers. It connects
inside a request, which blocks, and measures its time-out by the wall clock. Here a reply counts
only if `check_reply` of gateway.link.reply accepts its bytes. Connecting never blocks, and
time-outs run on the monotonic clock.

A connection counts from its first reply on, which may take longer than any other. It is given up
after the second failure in a row, and at once when its bytes are out of sync; gateway.link.patience
says how. A late reply to an abandoned request is recognised by its transaction id and dropped. The
exceptions 1, 2 and 3 say that map or unit are wrong, which no retry cures: before the first good
reply, the next attempt waits 2 s.
"""

import logging
import socket
import ssl
import time
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.pdu import ModbusPDU

from gateway.errors import PlcError
from gateway.link.connector import LAST_DELAY, Connector
from gateway.link.patience import Retired, Settling, first_request
from gateway.link.reply import Rejection, Request, check_reply
from gateway.link.tls import receive
from gateway.reasons import Reason
from register_maps.register_map import Block

READ_HOLDING: Final = 3
READ_INPUT: Final = 4
WRITE_ONE: Final = 6
WRITE_MANY: Final = 16
FAILURES_TO_CLOSE: Final = 2
PERMANENT: Final = frozenset({1, 2, 3})

logging.getLogger("pymodbus").setLevel(
    logging.CRITICAL + 1
)  # the gateway reports every failure itself, once


class LinkError(PlcError):
    """The link gave no good reply; `reason` is why."""

    def __init__(self, reason: Reason, text: str) -> None:
        super().__init__(text)
        self.reason = reason


class PlcLink(Protocol):
    """Link to a PLC as the loop needs it. Each method but `close` raises LinkError."""

    def connect(self) -> None:
        """Start or continue a connection attempt without waiting; nothing while connected."""

    def read(self, address: int, count: int, function: int = READ_HOLDING) -> tuple[int, ...]:
        """Words of one block, read by one request."""

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write one block by one request."""

    def close(self) -> None:
        """End the connection."""


class TcpLink:
    """One Modbus TCP connection to one unit, with one request at a time.

    timeout : of a request [s]; settle : of the first request after connecting [s]
    probe : block that the first request reads, None: a connection counts at once
    inspects : the exceptions 1, 2 and 3 are answers, after which it goes on
    tls : context of gateway.link.tls; None: a plain connection
    """

    def __init__(
        self,
        host: str,
        port: int,
        unit: int,
        timeout: float,
        clock: Callable[[], float] = time.monotonic,
        *,
        settle: float = 1.0,
        probe: Block | None = None,
        inspects: bool = False,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        self._peer = f"{host}:{port}"
        self._clock, self._settle = clock, settle
        self._probe = None if probe is None else first_request(unit, probe)
        self._settling: Settling | None = None
        self._retired = Retired(clock)
        self._unit = unit
        self._timeout = timeout
        self._connector = Connector(host, port, clock, tls)
        self._client: _Client | None = None
        self._abandoned: set[int] = set()
        self._failures = 0
        self._proven = inspects
        self._last = Rejection(reason=Reason.NOT_CONNECTED, text="not connected yet")

    def connect(self) -> None:
        """Start or continue a connection attempt without waiting; nothing while connected."""
        if self._client is not None:
            return
        connection = self._poll_connection() if self._retired.is_empty() else None
        if connection is None:
            raise self._error(self._last)
        self._client = _Client(connection, self._timeout)
        self._abandoned.clear()
        self._failures = 0

    def _poll_connection(self) -> socket.socket | None:
        """Connection that may be used; None: there is none yet, `_last` says why."""
        if self._settling is None:
            connection = self._connector.poll()
            if connection is None:
                if self._connector.problem:
                    self._last = _not_connected(f"cannot connect: {self._connector.problem}")
                return None
            if self._probe is None:
                return connection
            self._last = _not_connected("connected, no reply to the first request yet")
            self._settling = Settling(connection, self._probe, self._clock() + self._settle)
        return self._settle_down(self._settling)

    def _settle_down(self, settling: Settling) -> socket.socket | None:
        """Connection after its first reply; None: the reply is waited for, or was given up."""
        try:
            if settling.is_over():
                self._settling = None
                return settling.connection
        except OSError as error:
            self._last = _not_connected(error.strerror or str(error))
        else:
            if self._clock() < settling.deadline:
                return None
            self._last = _not_connected(f"no reply to the first request in {self._settle:g} s")
        self._retired.add(settling.connection)
        self._settling = None
        self._connector.note_failure()
        return None

    def read(self, address: int, count: int, function: int = READ_HOLDING) -> tuple[int, ...]:
        """Words of one block, read by one request."""
        client = self._require_client()
        ask = (
            client.read_input_registers if function == READ_INPUT else client.read_holding_registers
        )
        reply = self._ask(
            lambda: ask(address, count=count, device_id=self._unit), function, 2 + 2 * count
        )
        if len(reply.registers) != count:
            raise self._fail(_wrong_count(f"{len(reply.registers)} registers, expected {count}"))
        self._proven = True
        return tuple(reply.registers)

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write one block by one request."""
        client = self._require_client()
        reply = self._ask(
            lambda: client.write_registers(address, list(words), device_id=self._unit),
            WRITE_MANY,
            5,
        )
        if (reply.address, reply.count) != (address, len(words)):
            raise self._fail(
                _wrong_count(
                    f"{reply.count} registers at {reply.address} confirmed, "
                    f"expected {len(words)} at {address}"
                )
            )

    def write_one(self, address: int, word: int) -> None:
        """Write one register by function code 6."""
        client = self._require_client()
        reply = self._ask(
            lambda: client.write_register(address, word, device_id=self._unit), WRITE_ONE, 5
        )
        if (reply.address, list(reply.registers)) != (address, [word]):
            raise self._fail(_wrong_count(f"echo {reply.registers} at {reply.address}"))

    def close(self) -> None:
        """End the connection and any attempt."""
        self._connector.close()
        self._retired.close()
        if self._settling is not None:
            self._settling.connection.close()
            self._settling = None
        if self._client is not None:
            self._client.close()  # type: ignore[no-untyped-call]  # pymodbus declares none here
            self._client = None

    def _require_client(self) -> "_Client":
        if self._client is None:
            raise self._error(self._last)
        return self._client

    def _ask(self, call: Callable[[], ModbusPDU], function: int, length: int) -> ModbusPDU:
        """Reply to one request, checked; `length` is that of its PDU [bytes]."""
        client = self._require_client()
        client.begin()
        reply, refusal = _attempt(call)
        request = Request(
            transaction=client.transaction.next_tid,
            unit=self._unit,
            function=function,
            length=length,
        )
        self._abandoned.discard(request.transaction)  # ids repeat after 65000 requests
        rejection = refusal or check_reply(client.received, request, self._abandoned)
        if rejection is not None:
            if rejection.reason is Reason.TIMEOUT:
                self._abandoned.add(request.transaction)
            raise self._fail(rejection)
        if reply is None:
            raise self._fail(_wrong_count("reply cannot be decoded"))
        self._failures = 0
        self._connector.note_success()
        return reply

    def _fail(self, rejection: Rejection) -> LinkError:
        """Close the connection where this failure requires it; return the error to raise."""
        self._last = rejection
        if rejection.exception is None:
            self._failures += 1
        if self._failures >= FAILURES_TO_CLOSE or rejection.out_of_sync:
            self._hang_up(None)
        elif rejection.exception in PERMANENT and not self._proven:
            self._hang_up(LAST_DELAY)
        return self._error(rejection)

    def _hang_up(self, delay: float | None) -> None:
        client, self._client = self._client, None
        if client is not None and client.socket is not None:
            self._retired.add(client.socket)
            client.socket = None
        self._connector.note_failure(delay)

    def _error(self, rejection: Rejection) -> LinkError:
        return LinkError(rejection.reason, f"{self._peer} unit {self._unit}: {rejection.text}")


class _Client(ModbusTcpClient):
    """Client of pymodbus on a given connection: never connects itself, keeps the received bytes."""

    def __init__(self, connection: socket.socket, timeout: float) -> None:
        super().__init__("", timeout=timeout, retries=0)
        self.socket = connection
        self.received = b""
        self._deadline = 0.0

    def begin(self) -> None:
        """Begin a request: forget received bytes, start the time-out."""
        self.received = b""
        self._deadline = time.monotonic() + self.comm_params.timeout_connect

    def connect(self) -> bool:
        return self.socket is not None

    def recv(self, size: int | None) -> bytes:  # noqa: ARG002 - pymodbus's signature
        connection = self.socket
        while connection and (remaining := self._deadline - time.monotonic()) > 0.0:
            chunk = receive(connection, remaining)
            if chunk is None:
                continue
            if not chunk:
                raise ConnectionException("closed by the peer")
            self.received += chunk
            return chunk
        return b""


def _attempt(call: Callable[[], ModbusPDU]) -> tuple[ModbusPDU | None, Rejection | None]:
    """Reply as pymodbus decodes it, and the rejection where the connection itself failed."""
    try:
        return call(), None
    except (ConnectionException, OSError) as error:
        text = f"connection lost: {getattr(error, 'strerror', None) or error}"
        return None, Rejection(reason=Reason.CONNECTION_LOST, text=text, out_of_sync=True)
    except ModbusException:
        return None, None


def _not_connected(text: str) -> Rejection:
    return Rejection(reason=Reason.NOT_CONNECTED, text=text)


def _wrong_count(text: str) -> Rejection:
    return Rejection(reason=Reason.WRONG_COUNT, text=text)
