"""The residual of every run as a function of the unknowns of a fit (pure)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.input_noise import noise_directions
from plant_emulator.simulation.simulate import TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.estimation.unknowns import Estimate, Residual
    from plant_emulator.recordings.input_noise import NoiseDirections
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array


def residual_functions(
    recordings: Sequence[Recording],
    values: Mapping[str, float],
    free: Sequence[str],
    tolerance: float = TOLERANCE,
) -> list[Residual]:
    """For every run the residual as a function of the unknowns; the rest stays at `values`."""
    fixed = {n: v for n, v in values.items() if n not in free}

    def of(recording: Recording) -> Residual:
        def residual(found: Mapping[str, float]) -> Array:
            trial = {**fixed, **recording.own, **found}
            return recording.residual(*split_gap_position(trial), tolerance)

        return residual

    return [of(recording) for recording in recordings]


def whitened_functions(
    recordings: Sequence[Recording],
    values: Mapping[str, float],
    free: Sequence[str],
    near: Estimate,
) -> list[Residual] | None:
    """The same with the noise of what is fed as it is near a fit; None: it changes no run's."""
    directions = []
    for k, recording in enumerate(recordings):
        there = {**values, **recording.own, **near.parameters(), **near.states(k)}
        directions.append(noise_directions(recording, *split_gap_position(there)))
    if not any(directions):
        return None
    plain = residual_functions(recordings, values, free)
    return [
        simple if found is None else _whitened(found, simple)
        for found, simple in zip(directions, plain, strict=True)
    ]


def _whitened(found: NoiseDirections, residual: Residual) -> Residual:
    return lambda trial: found.whitened(residual(trial))
