"""Signals that ask the daemon for a ramp-down."""

import os
import signal

import pytest

from gateway.runtime.daemon import _signals, _Stop


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_asks_for_a_stop_and_ends_nothing_by_itself(number: signal.Signals) -> None:
    """A terminal that is closed sends SIGHUP, which would end the process without a ramp."""
    stop = _Stop(None)
    with _signals(stop):
        os.kill(os.getpid(), number)
        assert stop()
