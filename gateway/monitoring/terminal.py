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
from typing import Any, Final

from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table

from gateway.cycle.supervisor import State
from gateway.monitoring import page
from gateway.monitoring.block import RING, Change, Snapshot, Values
from gateway.monitoring.lines import LINES, PROBLEMS, text_line
from gateway.monitoring.shared import Observer

PERIOD: Final = 0.1
"""[s] Time between two looks at the block."""


def show_run(ended: Connection, path: Path, form: str) -> None:
    """Process: print each change of a run as a line until the daemon's end of the pipe closes."""
    observer, line = Observer(path), LINES[form]
    told, problem, live = 0, "", form == "text" and sys.stdout.isatty()
    with _screen(observer, live=live) as (console, draw):
        over = False
        while not over:
            over = ended.poll(PERIOD)
            snapshot = observer.snapshot()
            for text in new_lines(snapshot, told, line):
                console.print(text, markup=False)
            told = snapshot.values.changes
            found = page.problem_text(snapshot.values)
            if found not in ("", problem) and State(snapshot.values.state) is State.CONNECT:
                problem = found
                console.print(PROBLEMS[form](found, date(snapshot.values.now)), markup=False)
            draw(snapshot)


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
        console.print(rendered(observer.identity, observer.snapshot(), page.Trend()))


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
            shown.update(rendered(observer.identity, snapshot, trend), refresh=True)

    if not live:
        yield console, draw
        return
    with shown:
        yield console, draw


def rendered(identity: dict[str, Any], snapshot: Snapshot, trend: page.Trend) -> Panel:
    """The page of a snapshot for a terminal."""
    values = snapshot.values
    last = new_lines(snapshot, values.changes - page.LAST)
    return Panel(
        Group(
            _grid(page.status_rows(values, time.monotonic() - values.now)),
            _trends(values, trend),
            _grid(page.time_rows(snapshot)),
            _grid(page.count_rows(snapshot)),
            *last,
        ),
        title=identity["title"],
    )


def _grid(rows: list[page.Row]) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bold", min_width=18)
    for label, text in rows:
        grid.add_row(label, text)
    return grid


def _trends(values: Values, trend: page.Trend) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bold", min_width=18)
    grid.add_column(justify="right", min_width=14)
    for (label, text), (_, name, _) in zip(page.value_rows(values), page.ROWS, strict=True):
        grid.add_row(label, text, trend.line(name))
    return grid
