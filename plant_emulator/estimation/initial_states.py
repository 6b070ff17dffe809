"""What belongs to one run only: where in the gap it starts, and what its effects start from.

A run that is predicted keeps all parameters; only these states are fitted to it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.least_squares import estimate
from plant_emulator.estimation.robust_scan import scanned
from plant_emulator.estimation.start_search import Search
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.model.stage import GAP_POSITION, split_gap_position
from plant_emulator.solver.kernel import kernel

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.effects import Effect
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

    Effects = Mapping[str, Mapping[str, float]]

GAP = Unknown(name=GAP_POSITION, start=0.0, lower=-1.0, upper=1.0, logarithmic=False)


def states_of(own: Effects, known: Mapping[str, Effect] | None = None) -> tuple[Unknown, ...]:
    """The states of a run, the position in the gap first.

    own : values of the effects that the bench has, by effect and parameter
    known : the effects by name; None: those of the kernel
    """
    known = known if known is not None else kernel().effects
    return (
        GAP,
        *(
            Unknown(
                name=f"{effect}_{key}",
                start=value,
                lower=declared.lower,
                upper=declared.upper,
                logarithmic=False,
                prior=value,
                std=declared.std,
                step=declared.step,
                angle=declared.angle,
            )
            for effect, values in own.items()
            for key, value in values.items()
            if (declared := known[effect].parameters[key]).per_run and declared.std is not None
        ),
    )


def with_own(
    recording: Recording, own: Effects, known: Mapping[str, Effect] | None = None
) -> Recording:
    """The recording with those parameters of effects that its own log tells."""
    known = known if known is not None else kernel().effects
    measured = {
        f"{effect}_{key}": float(np.mean(recording.log[signal]))
        for effect, values in own.items()
        for key in values
        if (signal := known[effect].parameters[key].measured) and signal in recording.log
    }
    return replace(recording, own=measured)


def fit_states(
    recording: Recording, values: Mapping[str, float], states: Sequence[Unknown]
) -> dict[str, float]:
    """States that fit a run best, all parameters as given: scans, then least squares.

    values : all parameters [SI]
    """
    values = {**values, **recording.own}
    search = Search([recording], values, ())
    search.scan_gaps(41)

    def residual(found: Mapping[str, float]) -> Array:
        return recording.residual(*split_gap_position({**values, **found}))

    starts = {u.name: u.start for u in states} | {GAP_POSITION: search.gaps[0]}
    starts = scanned(residual, starts, [u for u in states if u.name != GAP_POSITION])
    unknowns = [replace(u, start=starts[u.name], run=0) for u in states]
    return estimate(unknowns, [residual]).states(0)
