"""The live page on a terminal: state, trends, times and last changes, from one snapshot (pure).

Units here are the operator's: rpm, Nm, ms.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from typing import Any, Final

from gateway.cycle.supervisor import State
from gateway.monitoring.alarms import Alarm
from gateway.monitoring.block import Snapshot, Values, quantile
from gateway.monitoring.lines import WARNED, reason_text
from register_maps.units import RPM

BARS: Final = "▁▂▃▄▅▆▇█"
WIDTH: Final = 48
"""Columns of a trend."""
FULL, EMPTY, BAR = "█", "░", 30
"""Signs and columns of a bar of progress."""
LAST: Final = 8
"""Changes on the page."""
STALLED: Final = 1.0
"""[s] A daemon whose last tick is older does not run as it should."""

Row = tuple[str, ...]
"""Label, and what stands beside it."""
ROWS: Final[tuple[tuple[str, str, Callable[[float], str]], ...]] = (
    ("setpoint, motor", "setpoint", lambda v: f"{v / RPM:.1f} rpm"),
    ("demand, motor", "demand", lambda v: f"{v / RPM:.1f} rpm"),
    ("motor", "motor_speed", lambda v: f"{v / RPM:.1f} rpm"),
    ("drum", "drum_speed", lambda v: f"{v:.3f} rad/s"),
    ("shaft torque", "shaft_torque", lambda v: f"{v:.2f} Nm"),
    ("armature current", "armature_current", lambda v: f"{v:.2f} A"),
    ("sample age", "age", lambda v: f"{v * 1e3:.0f} ms"),
    ("latency", "latency", lambda v: f"{v * 1e3:.2f} ms"),
)
TRENDS: Final = ("motor_speed", "setpoint", "drum_speed", "shaft_torque")


class Trend:
    """The last values of each signal that has a trend."""

    def __init__(self) -> None:
        self._values: dict[str, deque[float]] = {name: deque(maxlen=WIDTH) for name in TRENDS}

    def add(self, values: Values) -> None:
        """Take the values of a snapshot."""
        for name, kept in self._values.items():
            kept.append(getattr(values, name))

    def line(self, name: str) -> str:
        """Trend of a signal as bars; empty: it has none."""
        return bars(self._values[name]) if name in self._values else ""


def bars(values: Iterable[float]) -> str:
    """One bar a value between the least and the greatest; a blank for a missing value."""
    shown = list(values)
    finite = [value for value in shown if math.isfinite(value)]
    least = min(finite, default=0.0)
    span = max(finite, default=0.0) - least or 1.0
    return "".join(
        BARS[int((value - least) / span * (len(BARS) - 1))] if math.isfinite(value) else " "
        for value in shown
    )


def progress_rows(values: Values, planned: float | None) -> list[Row]:
    """Progress of a program that takes a planned time [s]; none outside of its run."""
    if planned is None or State(values.state) is not State.RUN:
        return []
    done = min(values.now - values.since, planned)
    bar = FULL * round(BAR * done / planned)
    return [("program", f"{bar:{EMPTY}<{BAR}} {done:.0f} of {planned:.0f} s")]


def status_rows(values: Values, age: float) -> list[Row]:
    """State and reason; age : of the last tick [s]."""
    shadow = " (shadow)" if values.shadow else ""
    rows: list[Row] = [
        ("state", f"{State(values.state).name}{shadow} for {values.now - values.since:.0f} s"),
        ("reason", reason_text(values.reason)),
    ]
    if text := problem_text(values):
        rows.append(("link", text))
    if age > STALLED:
        rows.append(("STALLED", f"no tick for {age:.1f} s"))
    return rows


def problem_text(values: Values) -> str:
    """Text of the link's last fault; empty where the last reading was good."""
    return values.problem.rstrip(b"\0").decode(errors="replace")


def value_rows(values: Values) -> list[Row]:
    """The measured and commanded values; a dash for a missing one."""
    return [
        (label, show(value) if math.isfinite(value := getattr(values, name)) else "-")
        for label, name, show in ROWS
    ]


def time_rows(snapshot: Snapshot) -> list[Row]:
    """Times of the tick and what was lost."""
    values = snapshot.values
    return [
        ("latency", _quantiles(snapshot.latency, values.latency_max)),
        ("wake-up", _quantiles(snapshot.lateness, values.lateness_max)),
        ("ticks", f"{values.ticks}, {values.lost} without a good image"),
        ("missed deadlines", f"{values.missed}"),
        ("records dropped", f"{values.dropped}"),
        ("runs", f"{values.runs}, {values.trips} tripped"),
    ]


def _quantiles(counts: Sequence[int], longest: float) -> str:
    shown = (f"{name} {_bound(quantile(counts, q))}" for name, q in (("p50", 0.5), ("p99", 0.99)))
    return f"{', '.join(shown)}, max {longest * 1e3:.2f} ms"


def _bound(duration: float) -> str:
    return f"< {duration * 1e3:g} ms" if math.isfinite(duration) else "-"


def count_rows(snapshot: Snapshot) -> list[Row]:
    """Reasons and faults that have occurred: changes to the reason, ticks with the fault."""
    return [
        (reason_text(code), f"reason of {count} changes", f"fault in {snapshot.faults[code]} ticks")
        for code, count in snapshot.reasons.items()
        if code and (count or snapshot.faults[code])
    ]


def alarm_rows(alarms: Sequence[Alarm], date: Callable[[float], datetime]) -> list[Row]:
    """Alarms, those that wait for the operator first; date : of a monotonic time [s]."""
    ordered = sorted(alarms, key=lambda alarm: alarm.acknowledged)
    return [(reason_text(alarm.reason), *alarm_cells(alarm, date)) for alarm in ordered]


def alarm_cells(alarm: Alarm, date: Callable[[float], datetime]) -> Row:
    """Count of an alarm, its first time, and whether it is acknowledged, in words."""
    times = f"{alarm.count} time{'s' if alarm.count > 1 else ''}"
    first = date(alarm.first).isoformat(timespec="seconds")
    return times, f"first {first}", f"{'' if alarm.acknowledged else 'not '}acknowledged"


def document(
    snapshot: Snapshot, age: float, lines: Sequence[str], alarms: Sequence[Row]
) -> dict[str, Any]:
    """The page as a JSON document; lines : of the last changes; alarms : their rows."""
    values = snapshot.values
    return {
        "status": status_rows(values, age),
        "warning": State(values.state) in WARNED or age > STALLED,
        "values": value_rows(values),
        "times": time_rows(snapshot),
        "counts": count_rows(snapshot),
        "alarms": alarms,
        "changes": lines,
        "trend": {
            name: value if math.isfinite(value := getattr(values, name)) else None
            for name in TRENDS
        },
    }
