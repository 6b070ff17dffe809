"""A pool that tells how far each step has come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from plant_emulator.diagnosis.execution.pool import Pool, Recipe
    from plant_emulator.diagnosis.machine import Model

    Progress = Callable[[str, float], None]

Item = TypeVar("Item")
Answer = TypeVar("Answer")

# What steps are told as, by the name of their function; the others are fits that start elsewhere.
SPOKEN = {
    "start": "fit without effects",
    "spread": "fit without effects",
    "find_input_noise": "noise of the inputs",
    "show": "what each effect changes",
    "contend": "first fits of effects",
    "follow": "fits of the best effects",
    "refit": "fits to their end",
    "fit_random_effect": "effects of chance",
    "alone": "each run alone",
    "site": "where the gap lies",
    "shown": "what held-out runs need",
    "predict": "held-out runs",
    "apart": "what to drive next",
    "rival": "what to drive next",
    "informs": "what to drive next",
    "seen": "what to drive next",
}
ELSEWHERE = "fits from elsewhere"


@dataclass(frozen=True)
class ReportingPool:
    """A pool; progress : told what is done and its done share, from 0 on."""

    pool: Pool
    progress: Progress

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        said = SPOKEN.get(function.__name__, ELSEWHERE)
        if items:
            self.progress(said, 0.0)
        for done, answer in enumerate(self.pool.map(function, recipe, items)):
            self.progress(said, (done + 1) / len(items))
            yield answer

    def close(self) -> None:
        """See `Pool`."""
        self.pool.close()
