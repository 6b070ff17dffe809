"""The progress bar's remaining time, with a virtual clock."""

import ast
from importlib.resources import files
from pathlib import Path

from rich.progress import Progress

from plant_emulator.cli._progress import reporter
from plant_emulator.diagnosis.execution.pool import InProcess
from plant_emulator.diagnosis.execution.progress import LABELS, ReportingPool


class Clock:
    """A virtual clock that the test moves."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_second_step_has_a_remaining_time_of_its_own() -> None:
    """After a step of 3 s, a quarter of the next step takes 2 s, so 6 s of it are left."""
    clock = Clock()
    bar = Progress(get_time=clock, disable=True)
    report = reporter(bar)
    for done in (0.0, 1 / 3, 2 / 3, 1.0):
        report("first fits", done)
        clock.now += 1.0
    report("held-out runs", 0.0)
    for done in (0.125, 0.25):
        clock.now += 1.0
        report("held-out runs", done)
    (task,) = bar.tasks
    assert task.description == "held-out runs"
    assert task.time_remaining == 6
    assert task.fields["before"] == "0:06 so far"


def test_every_step_of_a_pool_is_reported_from_its_begin() -> None:
    reported: list[tuple[str, float]] = []

    def refit(_model: object, item: int) -> int:
        return 2 * item

    class Nothing:
        def build(self) -> None:
            return None

        def digest(self) -> str:
            return "nothing"

    pool = ReportingPool(InProcess(), lambda step, done: reported.append((step, done)))
    assert list(pool.map(refit, Nothing(), [1, 2])) == [2, 4]  # type: ignore[arg-type]
    assert reported == [
        ("fits to their end", 0.0),
        ("fits to their end", 0.5),
        ("fits to their end", 1),
    ]


def test_each_label_is_that_of_a_step() -> None:
    folder = files("plant_emulator.diagnosis")
    sources = [path.read_text() for path in Path(str(folder)).rglob("*.py")]
    names = {
        node.name
        for source in sources
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef)
    }
    assert set(LABELS) <= names
