"""The rich model of the noise estimate: the columns of all effects of the library beside a fit.

What a rich model leaves is noise, or a cause that is not in the library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from plant_emulator.diagnosis.fidelity import Fidelity
    from plant_emulator.diagnosis.machine import Candidate
    from plant_emulator.signals.log import Array


def rich_columns(candidates: Mapping[str, Candidate], fidelity: Fidelity) -> Iterator[Array]:
    """Columns of all effects that a fit lacks, scaled to unit priors, shape (n, 1) each.

    An effect with states has columns of its own in each run: at their starts, and what each state
    changes that lies one deviation of its prior further. A state with many narrow basins stays.
    """
    size, largest = SETTINGS.sizes[0], max(SETTINGS.sizes)
    for name, candidate in candidates.items():
        if candidate.stochastic or name in fidelity.where.effects:
            continue
        values = values_at_size(candidate, size)
        plain = [{u.name: u.start for u in candidate.states} for _ in fidelity.where.states]
        change = fidelity.unwhitened(name, values, plain)
        if change is None or not change.any():
            continue
        columns, owners = [change], [np.ones(len(change))]
        if candidate.states:
            owners = [fidelity.owners == run for run in range(len(plain))]
        for u in candidate.states:
            moved = [{**own, u.name: u.start + (u.std or 0.0)} for own in plain]
            beside = fidelity.unwhitened(name, values, moved) if u.step is None else None
            if beside is not None:
                columns.append(beside - change)
        for column in (own * column for own in owners for column in columns):
            if column.any():
                yield largest / size * column[:, None]
