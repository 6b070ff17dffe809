"""The link against a peer that answers right, wrong, late, in pieces, or not at all."""

import itertools
import socket
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from gateway.errors import ConfigError, PlcError
from gateway.link.connector import Connector
from gateway.link.plc import LinkError, TcpLink
from gateway.reasons import Reason
from tests.gateway.peer import Answer, Peer, Request, frame, normal, peer

TIMEOUT = 0.05


@contextmanager
def linked(answer: Answer = normal) -> Iterator[tuple[TcpLink, Peer]]:
    """A connected link and its peer."""
    with peer(answer) as running:
        link = TcpLink("127.0.0.1", running.port, unit=1, timeout=TIMEOUT)
        connected(link)
        try:
            yield link, running
        finally:
            link.close()


def connected(link: TcpLink) -> None:
    deadline = time.monotonic() + 5.0
    while True:
        try:
            return link.connect()
        except LinkError:
            assert time.monotonic() < deadline
            time.sleep(0.001)


def reason_of(link: TcpLink) -> Reason:
    with pytest.raises(LinkError) as caught:
        link.read(10, 3)
    return caught.value.reason


def test_read_returns_the_words_of_the_block() -> None:
    with linked() as (link, _):
        assert link.read(10, 3) == (110, 111, 112)


def test_a_block_of_125_registers_is_read_in_one_request() -> None:
    with linked() as (link, running):
        assert link.read(0, 125) == tuple(range(100, 225))
        assert len(running.requests) == 1


def test_write_sends_function_code_16_once_with_these_words() -> None:
    with linked() as (link, running):
        link.write(64, [1, 2, 0xFFFF])
        (request,) = running.requests
        assert request.function == 16
        # start address, number of registers, number of bytes, registers
        assert request.data == struct.pack(">HHB3H", 64, 3, 6, 1, 2, 0xFFFF)


def test_input_registers_are_read_with_function_code_4() -> None:
    with linked() as (link, running):
        assert link.read(0, 2, function=4) == (100, 101)
        assert running.requests[0].function == 4


def test_one_register_is_written_with_function_code_6() -> None:
    with linked() as (link, running):
        link.write_one(5, 77)
        assert (running.requests[0].function, running.requests[0].data) == (6, bytes([0, 5, 0, 77]))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda _, good: good[:7] + b"\x04" + good[8:], Reason.WRONG_FUNCTION),
        (lambda r, _: frame(r.transaction, 1, b"\x03\x04\x00\x01\x00\x02"), Reason.WRONG_COUNT),
        (lambda r, _: frame(r.transaction, 1, b"\x03\x04" + 6 * b"\x01"), Reason.WRONG_COUNT),
        (lambda r, good: frame(r.transaction + 1, 1, good[7:]), Reason.WRONG_TRANSACTION),
        (lambda _, good: frame(0, 1, good[7:]), Reason.WRONG_TRANSACTION),
        (lambda r, good: frame(r.transaction, 2, good[7:]), Reason.WRONG_TRANSACTION),
        (lambda r, good: frame(r.transaction, 1, good[7:], protocol=5), Reason.WRONG_TRANSACTION),
        (lambda r, _: frame(r.transaction, 1, b"\x80\x01"), Reason.WRONG_FUNCTION),
        (lambda *_: b"", Reason.TIMEOUT),
        (lambda _, good: good[:-1], Reason.TIMEOUT),
        (lambda *_: None, Reason.CONNECTION_LOST),
    ],
    ids=[
        "function",
        "too few registers",
        "byte count and length differ",
        "transaction",
        "transaction 0",
        "unit",
        "protocol",
        "function 0x80",
        "silent",
        "stops in the middle",
        "hangs up",
    ],
)
def test_a_wrong_reply_is_refused_with_its_reason(change, reason) -> None:  # type: ignore[no-untyped-def]
    with linked(lambda request: change(request, normal(request))) as (link, _):
        assert reason_of(link) is reason


@pytest.mark.parametrize("code", range(1, 12))
def test_every_exception_has_its_own_reason(code: int) -> None:
    def refuse(request: Request) -> bytes:
        return frame(request.transaction, 1, bytes([request.function | 0x80, code]))

    with (
        linked(refuse) as (link, _),
        pytest.raises(LinkError, match=rf"exception {code}\b") as caught,
    ):
        link.read(10, 3)
    assert caught.value.reason.name == f"EXCEPTION_{code}"


def test_busy_does_not_end_the_connection() -> None:
    def busy_twice(request: Request) -> bytes:
        pdu = bytes([0x83, 6])
        return frame(request.transaction, 1, pdu) if request.transaction < 4 else normal(request)

    with linked(busy_twice) as (link, running):
        for _ in range(3):
            reason_of(link)
        assert link.read(10, 1) == (110,)
        assert running.connections == 1


def test_illegal_address_before_any_good_reply_is_not_asked_again_at_once() -> None:
    def illegal(request: Request) -> bytes:
        return frame(request.transaction, 1, bytes([0x83, 2]))

    with linked(illegal) as (link, running):
        reason_of(link)
        for _ in range(20):
            with pytest.raises(LinkError, match="illegal data address"):
                link.connect()
        assert len(running.requests) == 1


def test_a_late_reply_is_dropped_and_the_next_request_is_right() -> None:
    kept: list[bytes] = []

    def first_one_late(request: Request) -> bytes:
        if not kept:
            kept.append(normal(request))
            return b""
        return (
            kept.pop() + normal(request)
            if len(kept) == 1 and request.transaction == 2
            else normal(request)
        )

    with linked(first_one_late) as (link, running):
        assert reason_of(link) is Reason.TIMEOUT
        assert link.read(20, 2) == (120, 121)
        assert running.connections == 1


def test_a_reply_one_byte_at_a_time_is_taken() -> None:
    """The peer's one sendall becomes many segments here: each byte in its own."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        link = TcpLink("127.0.0.1", listener.getsockname()[1], unit=1, timeout=1.0)
        connected(link)
        peer_side = listener.accept()[0]
        peer_side.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in frame(1, 1, b"\x03\x02\x00\x2a"):
            peer_side.sendall(bytes([byte]))
        assert link.read(0, 1) == (42,)
        link.close()
        peer_side.close()


def test_a_timeout_takes_its_time_and_no_more() -> None:
    with linked(lambda _: b"") as (link, _):
        begun = time.monotonic()
        reason_of(link)
        assert TIMEOUT <= time.monotonic() - begun < TIMEOUT + 0.1


def test_the_second_failure_in_a_row_ends_the_connection() -> None:
    with linked(lambda _: b"") as (link, running):
        reason_of(link)
        link.connect()
        reason_of(link)
        with pytest.raises(LinkError):
            link.connect()
        connected(link)
        reason_of(link)
        assert running.connections == 2


def test_a_reply_cut_in_the_middle_ends_the_connection_at_once() -> None:
    with linked(lambda request: normal(request)[:-1]) as (link, _):
        reason_of(link)
        with pytest.raises(LinkError, match="stops after"):
            link.connect()


def test_a_reset_connection_is_a_fault_of_the_peer() -> None:
    def reset(request: Request) -> bytes | None:
        return None

    with linked(reset) as (link, _):
        assert reason_of(link) is Reason.CONNECTION_LOST
        with pytest.raises(LinkError):
            link.read(0, 1)


def test_nobody_listening_is_a_fault_and_does_not_wait() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    link = TcpLink("127.0.0.1", port, unit=1, timeout=TIMEOUT)
    begun = time.monotonic()
    for _ in range(50):
        with pytest.raises(LinkError) as caught:
            link.connect()
    assert time.monotonic() - begun < 0.1
    assert caught.value.reason is Reason.NOT_CONNECTED
    assert "refused" in str(caught.value)


def test_attempts_are_spaced_by_a_bounded_back_off() -> None:
    now = [0.0]
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    connector = Connector("127.0.0.1", port, clock=lambda: now[0])
    attempts = []
    while now[0] < 10.0:
        connector.problem = ""
        connector.poll()
        if connector.problem:
            attempts.append(now[0])
        now[0] = round(now[0] + 0.01, 2)
    gaps = [round(after - before, 2) for before, after in itertools.pairwise(attempts)]
    assert gaps == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0], abs=0.011)


def test_a_connection_sends_at_once_and_notices_a_dead_peer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        connector = Connector("127.0.0.1", listener.getsockname()[1])
        while (connection := connector.poll()) is None:
            pass
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) == 1
            assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 300


def test_an_unknown_host_is_refused_when_the_link_is_made() -> None:
    with pytest.raises(ConfigError, match="host"):
        TcpLink("no such host", 502, unit=1, timeout=TIMEOUT)


def test_name_servers_that_do_not_answer_are_no_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    """systemd starts the gateway again after exit code 1, and not after 2."""

    def unanswered(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")

    monkeypatch.setattr(socket, "getaddrinfo", unanswered)
    with pytest.raises(PlcError, match="plc: Temporary failure in name resolution") as raised:
        TcpLink("plc", 502, unit=1, timeout=TIMEOUT)
    assert raised.value.exit_code == 1
