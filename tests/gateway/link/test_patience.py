"""A PLC that is slow at first, or slow for once: nobody hangs up under a request that waits."""

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from gateway.link.connector import Connector
from gateway.link.patience import Settling
from gateway.link.plc import LinkError, TcpLink
from gateway.reasons import Reason
from register_maps.register_map import Block
from tests.gateway.peer import Request, frame, normal, peer

TIMEOUT = 0.04
PROBE = Block(table="holding", start=0, count=2)


def until_connected(link: TcpLink, within: float = 5.0) -> None:
    """Poll the link as the loop does, every millisecond."""
    deadline = time.monotonic() + within
    while True:
        try:
            return link.connect()
        except LinkError:
            assert time.monotonic() < deadline
            time.sleep(0.001)


@pytest.mark.parametrize("late", [0.06, 0.1, 0.3])
def test_first_reply_may_take_longer_than_the_time_out(late: float) -> None:
    """OpenPLC v3 answers the first request after 44 to 99 ms."""

    def slow_at_first(request: Request) -> bytes:
        if len(running.requests) == 1:
            time.sleep(late)
        return normal(request)

    with peer(slow_at_first) as running:
        link = TcpLink("127.0.0.1", running.port, 1, TIMEOUT, settle=5.0, probe=PROBE)
        until_connected(link)
        assert link.read(10, 2) == (110, 111)
        assert running.connections == 1
        assert (running.requests[0].function, running.requests[0].count) == (3, 2)
        link.close()


def test_connecting_does_not_wait_for_the_first_reply() -> None:
    with peer(lambda _: b"") as running:
        link = TcpLink("127.0.0.1", running.port, 1, TIMEOUT, settle=5.0, probe=PROBE)
        begun = time.monotonic()
        while not running.requests:
            with pytest.raises(LinkError):
                link.connect()
            assert time.monotonic() - begun < 5.0
        with pytest.raises(LinkError, match="no reply to the first request yet") as caught:
            link.connect()
        assert caught.value.reason is Reason.NOT_CONNECTED
        link.close()


def test_peer_that_never_answers_is_given_up_after_its_settle_time() -> None:
    with peer(lambda _: b"") as running:
        link = TcpLink("127.0.0.1", running.port, 1, TIMEOUT, settle=0.1, probe=PROBE)
        deadline = time.monotonic() + 5.0
        said = ""
        while "in 0.1 s" not in said:
            with pytest.raises(LinkError) as caught:
                link.connect()
            said = str(caught.value)
            assert time.monotonic() < deadline
        link.close()


def test_refusal_of_the_first_request_is_a_reply() -> None:
    with peer(lambda request: frame(request.transaction, 1, b"\x83\x02")) as running:
        link = TcpLink("127.0.0.1", running.port, 1, TIMEOUT, settle=5.0, probe=PROBE)
        until_connected(link)
        with pytest.raises(LinkError, match="illegal data address"):
            link.read(0, 2)
        link.close()


def test_peer_that_hangs_up_before_the_first_request_is_told_when_it_is_asked() -> None:
    """An error of the constructor would be taken for a mistake of ours."""
    ours, theirs = socket.socketpair()
    theirs.close()
    settling = Settling(ours, b"request", deadline=1.0)
    with pytest.raises(OSError):
        settling.is_over()
    ours.close()


@contextmanager
def served() -> Iterator[tuple[TcpLink, socket.socket]]:
    """A connected link, and the PLC's end of its connection."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        link = TcpLink("127.0.0.1", listener.getsockname()[1], 1, TIMEOUT)
        until_connected(link)
        plc = listener.accept()[0]
        plc.settimeout(5.0)
        yield link, plc
        link.close()
        plc.close()


def test_plc_may_still_answer_requests_that_were_given_up() -> None:
    """A reset would let a PLC runtime die of SIGPIPE at its second late reply."""
    with served() as (link, plc):
        for _ in range(2):
            with pytest.raises(LinkError, match="no reply in time"):
                link.read(10, 2)
        with pytest.raises(LinkError):
            link.connect()
        asked = plc.recv(300)
        assert len(asked) == 24
        for transaction in (1, 2):
            plc.sendall(frame(transaction, 1, b"\x03\x04\x00\x01\x00\x02"))
            with pytest.raises(LinkError):
                link.connect()
        assert plc.recv(300) == b""


def test_new_connection_waits_until_the_plc_has_closed_the_old_one() -> None:
    """Some PLCs have few connections, and drop the oldest."""
    now = [0.0]
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(5.0)
        port = listener.getsockname()[1]
        link = TcpLink("127.0.0.1", port, 1, 0.01, clock=lambda: now[0])
        until_connected(link)
        plc = listener.accept()[0]
        for _ in range(2):
            with pytest.raises(LinkError):
                link.read(10, 2)
        now[0] = 0.9
        listener.settimeout(0.05)
        with pytest.raises(LinkError):
            link.connect()
        with pytest.raises(TimeoutError):
            listener.accept()
        plc.close()
        listener.settimeout(5.0)
        until_connected(link)
        listener.accept()[0].close()
        link.close()


def test_every_address_of_a_name_is_tried() -> None:
    """As localhost, which is ::1 first where the PLC listens on 127.0.0.1 only."""
    now = [0.0]
    with (
        socket.create_server(("127.0.0.1", 0)) as deaf,
        socket.create_server(("127.0.0.1", 0)) as listener,
    ):
        deaf_port, port = deaf.getsockname()[1], listener.getsockname()[1]
        deaf.close()
        connector = Connector("127.0.0.1", deaf_port, clock=lambda: now[0])
        connector._addresses.append((socket.AF_INET, ("127.0.0.1", port)))
        deadline = time.monotonic() + 5.0
        while (connection := connector.poll()) is None:
            assert time.monotonic() < deadline
        connection.close()
