"""What is told of the time that a step needs yet, by a clock of the test's own."""

from rich.progress import Progress

from plant_emulator.cli._progress import teller
from plant_emulator.diagnosis.execution.pool import Here
from plant_emulator.diagnosis.execution.progress import Told


class Clock:
    """A clock that goes on when it is told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_second_step_has_a_remaining_time_of_its_own() -> None:
    """A step of 3 s, then a quarter of the next in 2 s: 6 s are left of it."""
    clock = Clock()
    drawn = Progress(get_time=clock, disable=True)
    tell = teller(drawn)
    for done in (0.0, 1 / 3, 2 / 3, 1.0):
        tell("first fits", done)
        clock.now += 1.0
    tell("held-out runs", 0.0)
    for done in (0.125, 0.25):
        clock.now += 1.0
        tell("held-out runs", done)
    (task,) = drawn.tasks
    assert task.description == "held-out runs"
    assert task.time_remaining == 6
    assert task.fields["before"] == "0:06 so far"


def test_every_step_of_a_pool_is_told_from_its_begin() -> None:
    told: list[tuple[str, float]] = []

    def refit(_model: object, item: int) -> int:
        return 2 * item

    class Nothing:
        def build(self) -> None:
            return None

        def digest(self) -> str:
            return "nothing"

    pool = Told(Here(), lambda step, done: told.append((step, done)))
    assert list(pool.map(refit, Nothing(), [1, 2])) == [2, 4]  # type: ignore[arg-type]
    assert told == [
        ("fits to their end", 0.0),
        ("fits to their end", 0.5),
        ("fits to their end", 1),
    ]
