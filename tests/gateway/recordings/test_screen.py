"""What the operator reads while the gateway runs."""

from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from gateway.cycle.record import NOTHING, Tick
from gateway.recordings.screen import View, state_line, status_table
from tests.gateway.recordings.test_recorder import LAYOUT, tick

HEADER = {
    "started": 1000.0,
    "title": "gateway",
    "states": {"1": "CONNECT", "4": "RUN", "5": "RAMPDOWN"},
    "reasons": {"12": ["TIMEOUT", "PLC did not answer in time"], "23": ["STALE", "no sample"]},
}


def record(made: Tick) -> np.void:
    packed = np.frombuffer(LAYOUT.pack(made), dtype=np.dtype(LAYOUT.formats))
    return packed[0]  # type: ignore[no-any-return]


def test_a_change_of_state_is_one_line_with_time_reason_and_fault() -> None:
    changed = replace(tick(250), state=5, reason=23, fault=12)
    assert state_line(HEADER, record(changed)) == (
        "    2.500 s  RAMPDOWN   STALE: no sample  fault TIMEOUT: PLC did not answer in time"
    )
    quiet = replace(tick(0), state=4, reason=NOTHING)
    assert state_line(HEADER, record(quiet)) == "    0.000 s  RUN"


def test_the_same_state_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    with View(HEADER, LAYOUT) as show:
        for index in range(5):
            show(LAYOUT.pack(replace(tick(index), state=4, reason=NOTHING)))
        show(LAYOUT.pack(replace(tick(5), state=5, reason=23)))
    assert [line.split()[2] for line in capsys.readouterr().out.splitlines()] == ["RUN", "RAMPDOWN"]


def test_the_table_is_in_the_operators_units() -> None:
    """0.1 rad/s of the motor are 0.955 rpm; what is not measured is a dash."""
    console = Console(width=80, record=True, file=None, quiet=False)
    with console.capture() as capture:
        console.print(status_table(HEADER, record(replace(tick(0), state=4, reason=NOTHING))))
    shown = capture.get()
    assert "RUN (shadow)" in shown
    assert "1.0 rpm" in shown
    assert "-12.80 Nm" in shown
    assert "0.40 ms" in shown
    assert "armature current" in shown
