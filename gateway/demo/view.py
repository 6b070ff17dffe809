"""The screen of a demo: the newest tick as a live table, or a line from time to time."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.live import Live
from rich.table import Table

from register_maps.units import KMH, RPM

LINE_EVERY: Final = 5.0
"""[s] Time of the cycle between two lines, where no table can be drawn."""


@dataclass(frozen=True, kw_only=True)
class Moment:
    """One tick in SI, NaN: unknown; time : of the cycle [s]; latency : of the tick [s]."""

    time: float
    state: str
    setpoint: float
    motor_speed: float
    drum_speed: float
    rim_speed: float
    shaft_torque: float
    latency: float
    missed: int


class Screen:
    """Shows moments as a table on a terminal, otherwise as lines."""

    def __init__(self, console: Console, title: str, duration: float) -> None:
        self._console, self._title, self._duration = console, title, duration
        self._live: Live | None = None
        self._next_line = 0.0

    @contextmanager
    def showing(self) -> Iterator[None]:
        """Draw the table inside the block."""
        if not self._console.is_terminal:
            yield
            return
        with Live(console=self._console, auto_refresh=False, transient=True) as live:
            self._live = live
            yield
        self._live = None

    def show(self, moment: Moment) -> None:
        """Show the newest tick."""
        if self._live is not None:
            self._live.update(self._table(moment), refresh=True)
        elif moment.time >= self._next_line:
            self._next_line = LINE_EVERY * (math.floor(moment.time / LINE_EVERY) + 1)
            self._console.print(
                f"  {moment.time:5.1f} s  {moment.state:9s} {moment.rim_speed / KMH:5.1f} km/h  "
                f"setpoint {moment.setpoint / RPM:6.0f} rpm  torque {moment.shaft_torque:6.1f} Nm",
                highlight=False,
            )

    def _table(self, moment: Moment) -> Table:
        table = Table(title=self._title, show_header=False, min_width=46, title_justify="left")
        table.add_column(style="bold")
        table.add_column(justify="right")
        rows = (
            ("time", f"{max(moment.time, 0.0):.1f} of {self._duration:g} s"),
            ("state", moment.state),
            ("setpoint", f"{moment.setpoint / RPM:.0f} rpm"),
            ("motor", f"{moment.motor_speed / RPM:.0f} rpm"),
            ("drum", f"{moment.drum_speed:.2f} rad/s, {moment.rim_speed / KMH:.1f} km/h"),
            ("shaft torque", f"{moment.shaft_torque:.1f} Nm"),
            ("latency", f"{1e3 * moment.latency:.2f} ms"),
            ("missed deadlines", str(moment.missed)),
        )
        for name, value in rows:
            table.add_row(name, value)
        return table
