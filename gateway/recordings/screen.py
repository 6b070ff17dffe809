"""The operator's view of a running gateway, drawn by the recorder's process.

Each change of state or reason gives a line. On a terminal, a table below is drawn anew a few times
a second. Units here are the operator's: rpm, Nm, ms.
"""

import math
import sys
from collections.abc import Callable
from typing import Any, Final, Self

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from gateway.cycle.record import NOTHING, SHADOW, Layout
from gateway.cycle.supervisor import State
from register_maps.units import RPM


class View:
    """Shows batches of records, as a context manager."""

    def __init__(self, header: dict[str, Any], layout: Layout) -> None:
        self._header = header
        self._type = np.dtype(layout.formats)
        self._shown: tuple[int, int] | None = None
        self._began = math.inf
        self._console = Console(highlight=False, soft_wrap=True)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)

    def __call__(self, batch: bytes) -> None:
        """Show a batch of whole records."""
        records = np.frombuffer(batch, dtype=self._type)
        for record in records:
            self._line(record)
        if self._live.is_started and len(records):
            table = status_table(self._header, records[-1])
            add_progress(table, self._header, float(records[-1]["now"]) - self._began)
            self._live.update(table, refresh=True)

    def __enter__(self) -> Self:
        if sys.stdout.isatty():
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def _line(self, record: np.void) -> None:
        current = (int(record["state"]), int(record["reason"]))
        if record["state"] == State.RUN:
            self._began = min(self._began, float(record["now"]))
        if current != self._shown:
            self._shown = current
            self._console.print(state_line(self._header, record), markup=False)


def state_line(header: dict[str, Any], record: np.void) -> str:
    """Line with time since the start, state, reason with its text, and fault of this tick."""
    state = header["states"][str(record["state"])]
    parts = [f"{record['now'] - header['started']:9.3f} s  {state:9s}"]
    if record["reason"] != NOTHING:
        parts.append(reason_text(header, record["reason"]))
    if record["fault"] not in (NOTHING, record["reason"]):
        parts.append(f"fault {reason_text(header, record['fault'])}")
    return "  ".join(parts).rstrip()


def reason_text(header: dict[str, Any], reason: int) -> str:
    """Name and text of a reason; a dash for none."""
    return ": ".join(header["reasons"][str(reason)]) if reason != NOTHING else "-"


def status_table(header: dict[str, Any], record: np.void) -> Table:
    """Table of one tick in the operator's units."""
    table = Table(title=header["title"], show_header=False, min_width=48)
    table.add_column(style="bold")
    table.add_column(justify="right")
    state = header["states"][str(record["state"])]
    table.add_row("state", state + (" (shadow)" if record["flags"] & SHADOW else ""))
    table.add_row("reason", reason_text(header, record["reason"]))
    for label, field, show in ROWS:
        value = float(record[field])
        table.add_row(label, show(value) if math.isfinite(value) else "-")
    table.add_row("missed deadlines", str(record["missed"]))
    return table


def add_progress(table: Table, header: dict[str, Any], time: float) -> None:
    """Add the progress of the run's program; time : since the begin of the run [s]."""
    if header.get("program"):
        name, duration = header["program"]
        done = min(max(time, 0.0), duration)
        table.add_row(name, ProgressBar(total=duration, completed=done, width=24))
        table.add_row("", f"{done:.0f} of {duration:.0f} s")


ROWS: Final[tuple[tuple[str, str, Callable[[float], str]], ...]] = (
    ("setpoint, motor", "setpoint_speed_setpoint", lambda v: f"{v / RPM:.1f} rpm"),
    ("demand, motor", "demand", lambda v: f"{v / RPM:.1f} rpm"),
    ("motor", "measured_motor_speed", lambda v: f"{v / RPM:.1f} rpm"),
    ("drum", "measured_drum_speed", lambda v: f"{v:.3f} rad/s"),
    ("shaft torque", "measured_shaft_torque", lambda v: f"{v:.2f} Nm"),
    ("armature current", "measured_armature_current", lambda v: f"{v:.2f} A"),
    ("sample age", "age", lambda v: f"{v * 1e3:.0f} ms"),
    ("latency", "latency", lambda v: f"{v * 1e3:.2f} ms"),
)
