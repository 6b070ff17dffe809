"""Lines of the log: one for each change of state or reason, dated, as text or as JSON (pure)."""

import json
from collections.abc import Callable
from datetime import datetime
from typing import Final

from gateway.cycle.record import NOTHING
from gateway.cycle.supervisor import State
from gateway.monitoring.block import Change
from gateway.reasons import REASONS

WARNED: Final = frozenset({State.RAMPDOWN, State.SAFE})
"""States whose line is a warning."""
HINTS: Final = {
    State.ARMED: "to start: turn remote on at the PLC, from off",
    State.SAFE: "to acknowledge: turn remote off and on at the PLC",
}
"""What the operator does next."""
Line = Callable[[Change, datetime], str]


def text_line(change: Change, date: datetime) -> str:
    """Line with date, state, reason with its text, and fault of this tick."""
    return f"{_iso(date)}  {state_text(change.state, change.reason, change.fault)}"


def state_text(state: int, reason: int, fault: int) -> str:
    """State, reason with its text, a fault that is not the reason, and what to do."""
    parts = [f"{State(state).name:9s}"]
    if reason != NOTHING:
        parts.append(reason_text(reason))
    if fault not in (NOTHING, reason):
        parts.append(f"fault {reason_text(fault)}")
    if State(state) in HINTS:
        parts.append(f"({HINTS[State(state)]})")
    return "  ".join(parts).rstrip()


def json_line(change: Change, date: datetime) -> str:
    """Line as a JSON object; a missing reason or fault is null."""
    state = State(change.state)
    return json.dumps(
        {
            "time": _iso(date),
            "level": "warning" if state in WARNED else "info",
            "event": "state",
            "state": state.name,
            "reason": _name(change.reason),
            "fault": _name(change.fault),
            "tick": change.tick,
            "message": state_text(change.state, change.reason, change.fault),
        }
    )


LINES: Final[dict[str, Line]] = {"text": text_line, "json": json_line}
"""Forms of the log by their names."""


def text_note(event: str, text: str, date: datetime, *, warning: bool = True) -> str:
    """Line of what is no change of state: the start, the link's words, lines left out."""
    del warning  # the text says so
    return f"{_iso(date)}  {event:9s}  {text}"


def json_note(event: str, text: str, date: datetime, *, warning: bool = True) -> str:
    """Line of what is no change of state as a JSON object."""
    level = "warning" if warning else "info"
    return json.dumps({"time": _iso(date), "level": level, "event": event, "message": text})


NOTES: Final[dict[str, Callable[..., str]]] = {"text": text_note, "json": json_note}
"""Forms of a note by their names."""


def reason_text(code: int) -> str:
    """Name and text of a reason; a dash for none."""
    return f"{REASONS[code].name}: {REASONS[code].text}" if code != NOTHING else "-"


def _name(code: int) -> str | None:
    return REASONS[code].name if code != NOTHING else None


def _iso(date: datetime) -> str:
    return date.isoformat(timespec="milliseconds")
