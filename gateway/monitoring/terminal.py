"""The terminal: lines of a run as they come, and the live page, from the status block alone.

A terminal may stall for ever (Ctrl-S, a frozen connection). Hence it has a process of its own,
which neither the loop nor the recorder waits for.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table

from gateway.cycle.supervisor import State
from gateway.monitoring import page
from gateway.monitoring.block import RING, Change, Snapshot, Values
from gateway.monitoring.lines import LINES, NOTES, reason_text, text_line
from gateway.monitoring.rate import Rate
from gateway.monitoring.shared import Identity, Observer

PERIOD: Final = 0.1
"""[s] Time between two looks at the block."""


def show_run(ended: Connection, path: Path, form: str) -> None:
    """Process: print the lines of a run until the daemon's end of the pipe closes."""
    observer = Observer(path)
    log = RunLog(observer.identity, form)
    with _screen(observer, live=form == "text" and sys.stdout.isatty()) as (console, draw):
        over = False
        while not over:
            over = ended.poll(PERIOD)
            snapshot = observer.snapshot()
            for text in log.lines(snapshot, time.monotonic(), over=over):
                console.print(text, markup=False)
            draw(snapshot)


class RunLog:
    """The lines of a run: start, changes, alarms, the link's words; no more than the rate allows.

    identity : of the daemon, as the status block has it; form : one of LINES
    """

    def __init__(self, identity: Identity, form: str) -> None:
        self._line, self._note = LINES[form], NOTES[form]
        self._start: str | None = f"{identity.recording}; real time: {identity.real_time}"
        self._refused = " no (" in identity.real_time
        self._told, self._problem = 0, ""
        self._alarms: set[object] = set()
        self._rate = Rate(self._left_out)

    def lines(self, snapshot: Snapshot, now: float, *, over: bool) -> list[str]:
        """Lines since the last snapshot; now : monotonic time [s]; over : they are the last."""
        values, found = snapshot.values, page.problem_text(snapshot.values)
        new = new_lines(snapshot, self._told, self._line)
        lost, self._told = values.changes - self._told - len(new), values.changes
        new += self._alarm_lines(snapshot)
        if self._start is not None:
            start, self._start = self._start, None
            new = [self._note("start", start, date(now), warning=self._refused), *new]
        if found not in ("", self._problem) and State(values.state) is State.CONNECT:
            self._problem = found
            new.append(self._note("link", found, date(values.now)))
        passed = self._rate.filter(new, now, lost=lost)
        return passed + (self._rate.flush() if over else [])

    def _alarm_lines(self, snapshot: Snapshot) -> list[str]:
        """A line for each alarm that has come, come again or been acknowledged."""
        changed = [one for one in snapshot.alarms if one not in self._alarms]
        self._alarms = set(snapshot.alarms)
        return [
            self._note(
                "alarm",
                f"{reason_text(one.reason)}: {', '.join(page.alarm_cells(one, date))}",
                date(snapshot.values.acknowledged if one.acknowledged else one.last),
                warning=not one.acknowledged,
            )
            for one in changed
        ]

    def _left_out(self, count: int) -> str:
        return self._note("log", f"{count} lines left out", date(time.monotonic()))


def new_lines(
    snapshot: Snapshot, told: int, line: Callable[[Change, datetime], str] = text_line
) -> list[str]:
    """Lines of the changes since the first `told` ones; the ring keeps the last of them."""
    count = min(snapshot.values.changes - told, RING)
    return [
        line(change, date(change.now))
        for change in snapshot.changes[len(snapshot.changes) - count :]
    ]


def date(now: float) -> datetime:
    """Date of a monotonic time [s], in the time zone of this computer."""
    past = timedelta(seconds=time.monotonic() - now)
    return (datetime.now(UTC) - past).astimezone()


def watch(observer: Observer, console: Console) -> None:
    """Draw the page of a running daemon until Ctrl-C or its end; once where no terminal is."""
    with _screen(observer, live=console.is_terminal, console=console) as (_, draw):
        draw(observer.snapshot())
        while console.is_terminal and observer.is_alive():
            time.sleep(PERIOD)
            draw(observer.snapshot())
    if not console.is_terminal:
        console.print(render(observer.identity, observer.snapshot(), page.Trend()))


@contextmanager
def _screen(
    observer: Observer, *, live: bool, console: Console | None = None
) -> Iterator[tuple[Console, Callable[[Snapshot], None]]]:
    """Console, and a function that draws a snapshot at its bottom; without `live` it does not."""
    console = console or Console(highlight=False, soft_wrap=True)
    trend, shown = page.Trend(), Live(console=console, auto_refresh=False, transient=True)

    def draw(snapshot: Snapshot) -> None:
        trend.add(snapshot.values)
        if live:
            shown.update(render(observer.identity, snapshot, trend), refresh=True)

    if not live:
        yield console, draw
        return
    with shown:
        yield console, draw


def render(identity: Identity, snapshot: Snapshot, trend: page.Trend) -> Panel:
    """The page of a snapshot for a terminal."""
    values = snapshot.values
    last = new_lines(snapshot, values.changes - page.LAST)
    return Panel(
        Group(
            _grid(page.status_rows(values, time.monotonic() - values.now)),
            _grid(page.progress_rows(values, identity.planned)),
            _grid(page.alarm_rows(snapshot.alarms, date)),
            _trends(values, trend),
            _grid(page.time_rows(snapshot)),
            _grid(page.count_rows(snapshot)),
            *last,
        ),
        title=identity.title,
    )


def _grid(rows: list[page.Row]) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bold", min_width=18)
    for row in rows:
        grid.add_row(*row)
    return grid


def _trends(values: Values, trend: page.Trend) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bold", min_width=18)
    grid.add_column(justify="right", min_width=14)
    for (label, text), (_, name, _) in zip(page.value_rows(values), page.ROWS, strict=True):
        grid.add_row(label, text, trend.line(name))
    return grid
