"""What systemd hears, at a datagram socket that stands for its own."""

import itertools
import os
import socket
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.cycle.record import NOTHING, Tick
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from gateway.runtime.notify import Notifier
from tests.gateway.monitoring.test_block import good
from tests.gateway.recordings.test_recorder import tick

NOBODY = replace(
    tick(0, read_back=False), state=State.CONNECT, reason=int(Reason.NOT_CONNECTED), fault=NOTHING
)


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as made:
        made.bind(str(tmp_path / "notify"))
        made.setblocking(False)
        yield made


def heard(systemd: socket.socket) -> list[str]:
    lines = []
    while True:
        try:
            lines += systemd.recv(4096).decode().splitlines()
        except BlockingIOError:
            return lines


def told(systemd: socket.socket, *ticks: Tick, **environment: str) -> list[list[str]]:
    """What systemd hears after each tick."""
    notifier = Notifier({"NOTIFY_SOCKET": str(systemd.getsockname()), **environment})
    try:
        return [[notifier(one), *heard(systemd)][1:] for one in ticks]  # type: ignore[func-returns-value]
    finally:
        notifier.close()


def test_ready_is_the_first_good_image_and_not_the_start(systemd: socket.socket) -> None:
    first, second, third = told(systemd, NOBODY, good(1, State.SHADOW), good(2, State.SHADOW))
    assert first == ["STATUS=CONNECT    NOT_CONNECTED: no connection to the PLC"]
    assert second == ["READY=1", "STATUS=SHADOW"]
    assert third == []


def test_watchdog_is_fed_by_ticks_three_times_a_period_also_before_the_plc_is_there(
    systemd: socket.socket,
) -> None:
    ticks = [replace(NOBODY, now=0.1 * k) for k in range(40)]
    fed = told(systemd, *ticks, WATCHDOG_USEC="2000000", WATCHDOG_PID=str(os.getpid()))
    at = [0.1 * k for k, lines in enumerate(fed) if "WATCHDOG=1" in lines]
    assert len(at) == pytest.approx(3.9 / (2.0 / 3.0), abs=1)
    assert max(b - a for a, b in itertools.pairwise(at)) < 1.0


@pytest.mark.parametrize("environment", [{}, {"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": "1"}])
def test_watchdog_of_nobody_or_of_another_process_is_not_fed(
    systemd: socket.socket, environment: dict[str, str]
) -> None:
    fed = told(systemd, *(replace(NOBODY, now=float(k)) for k in range(9)), **environment)
    assert not any("WATCHDOG=1" in lines for lines in fed)


def test_stop_is_told_once(systemd: socket.socket) -> None:
    stopping = replace(good(1), stop_requested=True)
    first, second, third = told(systemd, good(0), stopping, stopping)
    assert ("STOPPING=1" in first, "STOPPING=1" in second, third) == (False, True, [])


def test_systemd_that_does_not_listen_costs_the_tick_nothing(systemd: socket.socket) -> None:
    address = str(systemd.getsockname())
    notifier = Notifier({"NOTIFY_SOCKET": address})
    for index in range(2000):  # more than the socket's queue holds
        notifier(good(index, State.RUN if index % 2 else State.ARMED))
    systemd.close()
    notifier(good(3))
    notifier.close()


def test_without_systemd_nothing_is_told() -> None:
    notifier = Notifier({})
    notifier(good(0))
    notifier.close()
