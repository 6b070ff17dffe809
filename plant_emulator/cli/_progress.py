"""A progress bar on standard error where that is a terminal; silence otherwise."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.progress import Progress

    Tell = Callable[[str, float], None]


@contextmanager
def progress() -> Iterator[Tell | None]:
    """A function to be called with a step's name and how far it has come, 0 to 1; or None."""
    if not sys.stderr.isatty():
        yield None
        return
    with bars() as drawn:
        yield teller(drawn)


def bars() -> Progress:
    """Step, done share, what it needs yet, and the time since the begin."""
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


def teller(drawn: Progress) -> Tell:
    """What moves the bar; where a share falls, a new step has begun.

    The remaining time is that of the step: how many steps are to come depends on what they find.
    """
    begun = drawn.get_time()
    task = drawn.add_task("", total=1.0, before="")
    last = 0.0

    def tell(step: str, done: float) -> None:
        nonlocal last
        minutes, seconds = divmod(int(drawn.get_time() - begun), 60)
        before = f"{minutes}:{seconds:02d} so far"
        if done < last:
            drawn.reset(task)
        drawn.update(task, completed=done, description=step, before=before)
        last = done

    return tell
