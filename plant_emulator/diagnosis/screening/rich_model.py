"""The rich model of the noise estimate: the columns of all effects of the library beside a fit.

What a rich model leaves is noise, or a cause that is not in the library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from plant_emulator.diagnosis.fidelity import Fidelity
    from plant_emulator.diagnosis.machine import Candidate
    from plant_emulator.signals.log import Array


def rich_columns(candidates: Mapping[str, Candidate], fidelity: Fidelity) -> Iterator[Array]:
    """Columns of all effects that a fit lacks, scaled to unit priors, shape (n, 1) each."""
    size = SETTINGS.sizes[0]
    for name, candidate in candidates.items():
        if candidate.stochastic or name in fidelity.where.effects:
            continue
        states = [{u.name: u.start for u in candidate.states} for _ in fidelity.where.states]
        change = fidelity.unwhitened(name, values_at_size(candidate, size), states)
        if change is not None and change.any():
            yield SETTINGS.largest_size / size * change[:, None]
