"""What systemd is told over its socket: ready, alive, state, stopping (sd_notify).

Ready is the first good image of the PLC. The tick itself feeds the watchdog, so that a loop that
stands still is restarted. The socket never waits: a message that finds no room is left out.
"""

import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import Final

from gateway.cycle.record import Tick
from gateway.monitoring.lines import state_text

MICRO: Final = 1e-6
FEEDS: Final = 3
"""Feeds within one period of the watchdog."""


class Notifier:
    """Tells systemd about every tick; without its socket it tells nothing."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        self._address = environment.get("NOTIFY_SOCKET", "")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._period = _watchdog(environment) / FEEDS
        self._fed = -self._period
        self._ready = self._stopping = False
        self._told = ""

    def __call__(self, tick: Tick) -> None:
        """Tell what this tick has changed."""
        if not self._address:
            return
        messages = []
        if tick.measurement is not None and not self._ready:
            self._ready = True
            messages.append("READY=1")
        if tick.stop_requested and not self._stopping:
            self._stopping = True
            messages.append("STOPPING=1")
        if self._period and tick.now - self._fed >= self._period:
            self._fed = tick.now
            messages.append("WATCHDOG=1")
        if (status := state_text(tick.state, tick.reason, tick.fault)) != self._told:
            self._told = status
            messages.append(f"STATUS={status}")
        if messages:
            self._send("\n".join(messages))

    def _send(self, message: str) -> None:
        address = self._address
        with suppress(OSError):  # systemd is restarting, or its queue is full
            self._socket.sendto(message.encode(), address.replace("@", "\0", address[0] == "@"))

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def _watchdog(environment: Mapping[str, str]) -> float:
    """Period of the watchdog [s]; 0: there is none, or it is another process's."""
    if environment.get("WATCHDOG_PID", str(os.getpid())) != str(os.getpid()):
        return 0.0
    text = environment.get("WATCHDOG_USEC", "")
    return int(text) * MICRO if text.isdecimal() else 0.0
