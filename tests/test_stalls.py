"""The process that measures how late this computer wakes."""

import os
import signal
from threading import Event

from tests.stalls import Stalls

STOPPED = 0.1
"""[s] Time for which the process is stopped, as a busy computer would stop it."""


def test_a_stop_of_the_process_is_told_once() -> None:
    stalls = Stalls()
    try:
        stalls.largest()
        os.kill(stalls.pid, signal.SIGSTOP)
        Event().wait(STOPPED)
        os.kill(stalls.pid, signal.SIGCONT)
        told = stalls.largest()
        assert STOPPED - 0.01 < told < 50.0 * STOPPED
        assert stalls.largest() < told
    finally:
        stalls.close()
