"""A pool whose results are told as they come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from plant_emulator.diagnosis.model import Model
    from plant_emulator.diagnosis.pool import Pool, Recipe
    from plant_emulator.diagnosis.steps import Task

    Progress = Callable[[str, float], None]

Found = TypeVar("Found")


@dataclass(frozen=True)
class ToldPool:
    """A diagnosis's pool.

    progress : told the stage and its done share
    """

    pool: Pool
    recipe: Recipe
    progress: Progress | None = None

    def all_of(
        self, step: Callable[[Model, Task], Found], tasks: Sequence[Task], stage: str
    ) -> list[Found]:
        """What a step finds of every task, in their order."""
        every = []
        for done, one in enumerate(self.pool.map(step, self.recipe, tasks)):
            if self.progress is not None:
                self.progress(stage, (done + 1) / len(tasks))
            every.append(one)
        return every
