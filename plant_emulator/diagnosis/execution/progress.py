"""The progress of a diagnosis: a pool that reports how far each step has come."""

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

# What a person reads about a step, by the name of its function.
LABELS = {
    "simulate_once": "start of the processes",
    "start": "fit without effects",
    "find_input_noise": "noise of the inputs",
    "estimate_noise": "noise of the sensors",
    "find_disturbances": "noise of the sensors",
    "start_states": "what each effect promises",
    "screen": "what each effect promises",
    "confirm": "first fits of effects",
    "lead_trial": "fits along the measured speeds",
    "refit_along": "fits along the measured speeds",
    "refit": "fits to their end",
    "run_agreement": "whether the runs agree",
    "gain_beside_forms": "what other forms of the laws gain",
    "errors_beside_forms": "errors of the sizes",
    "visibilities": "what the logs can show",
    "fit_random_effect": "random effects",
    "fit_alone": "each run alone",
    "locate_gap": "where the gap lies",
    "signature_norms": "what held-out runs need",
    "predict": "held-out runs",
    "discriminability": "what to drive next",
    "fit_alternative": "what to drive next",
    "information_gain": "what to drive next",
    "visibility": "what to drive next",
}
# Most other steps are fits from other starts.
OTHER_LABEL = "fits from other starts"


@dataclass(frozen=True)
class ReportingPool:
    """A pool that reports progress.

    progress : called with the label of a step and its done share [1], from 0 on
    """

    pool: Pool
    progress: Progress

    def map(
        self, function: Callable[[Model, Item], Answer], recipe: Recipe, items: Sequence[Item]
    ) -> Iterator[Answer]:
        """See `Pool`."""
        label = LABELS.get(function.__name__, OTHER_LABEL)
        if items:
            self.progress(label, 0.0)
        return self._each(self.pool.map(function, recipe, items), label, len(items))

    def _each(self, answers: Iterator[Answer], label: str, count: int) -> Iterator[Answer]:
        for done, answer in enumerate(answers):
            self.progress(label, (done + 1) / count)
            yield answer

    def close(self) -> None:
        """See `Pool`."""
        self.pool.close()
