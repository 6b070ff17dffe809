"""What a fit leaves of a channel as no noise does: turn by turn, or after its own quantity.

An estimated noise takes in whatever is small and goes on for long. A wave of the turns and the
hysteresis of a sensor are so, and no noise of a sensor follows the turns or the quantity.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_emulator.estimation.hysteresis import ShownValues, hysteresis_squares
from plant_emulator.estimation.order_spectrum import TurningRun, strongest_ripple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model

# Orders that are looked for [1 a turn of the drum]: what is slower is drift, and the third order of
# the bench's motor is the highest one.
LOWEST_ORDER, HIGHEST_ORDER = 0.5, 190.0
# Squares that the hysteresis of any channel reaches by chance once in a million diagnoses.
HYSTERESIS_SQUARES = 30.0


@dataclass(frozen=True, kw_only=True)
class Regularity:
    """A regularity of what a fit leaves.

    channel : that shows it; what : it does, as a part of a sentence
    squares : of the residual that it holds in all runs [chi squared]
    by_noise : squares that noise reaches
    """

    channel: str
    what: str
    squares: float
    by_noise: float

    @property
    def significant(self) -> bool:
        """Whether noise does not explain it."""
        return self.squares > self.by_noise


def find_regularities(model: Model, task: Task) -> list[Regularity]:
    """Find the strongest order and the hysteresis of every channel at a fit (a step).

    A run that cannot be simulated at the fit is left out.
    """
    turning: dict[str, list[TurningRun]] = {}
    shown: dict[str, list[ShownValues]] = {}
    effects = task.base.effects
    for k, states in zip(task.runs, task.base.states, strict=True):
        run, values = model.runs[k], {**task.base.values, **states}
        course = model.course(k, effects, values)
        if course is None:
            continue
        white = model.residual(k, effects)(values)
        plain = model.unwhitened_residual(k, effects)(values)
        for c, name in enumerate(run.channels):
            if course.turns is not None:
                used = white[c] != 0.0
                turning.setdefault(name, []).append(
                    TurningRun(
                        time=run.time[used], turns=course.turns[used], residual=white[c][used]
                    )
                )
            quantity = course.channels[c] / run.noise[c]
            shown.setdefault(name, []).append(
                ShownValues(run.time, quantity, plain[c], plain[c] != 0.0)
            )
    return [*_ripples(turning), *_hystereses(shown)]


def _ripples(turning: Mapping[str, Sequence[TurningRun]]) -> list[Regularity]:
    found = {
        name: strongest_ripple(runs, LOWEST_ORDER, HIGHEST_ORDER) for name, runs in turning.items()
    }
    return [
        Regularity(
            channel=name,
            what=f"repeats {one.order:.3g} times a turn of the drum",
            squares=one.squares,
            by_noise=one.by_noise,
        )
        for name, one in found.items()
        if one is not None
    ]


def _hystereses(shown: Mapping[str, Sequence[ShownValues]]) -> list[Regularity]:
    return [
        Regularity(
            channel=name,
            what="follows the channel's own value with a hysteresis",
            squares=hysteresis_squares(runs),
            by_noise=HYSTERESIS_SQUARES,
        )
        for name, runs in shown.items()
    ]
