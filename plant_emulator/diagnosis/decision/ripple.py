"""Ripple: what a fit leaves of a channel and repeats with the turns of the machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.estimation.order_spectrum import strongest_ripple

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fitting.task import Task
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.estimation.order_spectrum import Ripple
    from plant_emulator.signals.log import Array

# Orders that are looked for [1 a turn of the drum]: what is slower is drift, and the motor's third
# order is the highest one.
LOWEST_ORDER, HIGHEST_ORDER = 0.5, 190.0


def find_ripples(model: Model, task: Task) -> dict[str, Ripple]:
    """Find the strongest order of every channel in what `task.base` leaves (a step).

    A run that does not turn is left out, and a channel without another run.
    """
    effects = task.base.effects
    series: dict[str, list[tuple[Array, Array]]] = {}
    for k, states in zip(task.runs, task.base.states, strict=True):
        values = {**task.base.values, **states}
        turns = model.turns(k, effects, values)
        if turns is not None:
            rows = model.residual(k, effects)(values)
            for name, row in zip(model.runs[k].channels, rows, strict=True):
                series.setdefault(name, []).append((turns[row != 0.0], row[row != 0.0]))
    found = {
        name: strongest_ripple(runs, LOWEST_ORDER, HIGHEST_ORDER) for name, runs in series.items()
    }
    return {name: one for name, one in found.items() if one is not None}
