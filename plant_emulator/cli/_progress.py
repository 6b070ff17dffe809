"""A progress bar on standard error. Without a terminal there is none."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.progress import Progress

    Report = Callable[[str, float], None]


@contextmanager
def progress() -> Iterator[Report | None]:
    """Show a progress bar; yield the function that moves it, or None without a terminal.

    The function takes a step's name and the share of the step that is done, 0 to 1.
    """
    if not sys.stderr.isatty():
        yield None
        return
    with new_bar() as bar:
        yield reporter(bar)


def new_bar() -> Progress:
    """A bar with the step's name, its share done, its time left and the time since the start."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        TextColumn("left; {task.fields[before]}"),
        console=Console(stderr=True),
        transient=True,
    )


def reporter(bar: Progress) -> Report:
    """The function that moves the bar. A share that falls begins a new step.

    The time left is that of the step, because the number of later steps is not known yet.
    """
    begin = bar.get_time()
    task = bar.add_task("", total=1.0, before="")
    last = 0.0

    def report(step: str, done: float) -> None:
        nonlocal last
        minutes, seconds = divmod(int(bar.get_time() - begin), 60)
        before = f"{minutes}:{seconds:02d} so far"
        if done < last:
            bar.reset(task)
        bar.update(task, completed=done, description=step, before=before)
        last = done

    return report
