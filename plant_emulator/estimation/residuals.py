"""Residuals of runs as functions of the unknowns of a fit (pure)."""

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


def residual_function(
    recording: Recording, values: Mapping[str, float], tolerance: float = TOLERANCE
) -> Residual:
    """Residual of a run as a function of the unknowns, shape (channels, samples).

    values : of everything that is not unknown [SI]
    """

    def residual(found: Mapping[str, float]) -> Array:
        return recording.residual(*split_gap_position({**values, **found}), tolerance)

    return residual


def whiten_function(residual: Residual, noise: NoiseDirections | None) -> Residual:
    """The residual function, whitened for the noise of a measured input; None: as it is."""
    if noise is None:
        return residual
    return lambda found: noise.whiten(residual(found))


def residual_functions(
    recordings: Sequence[Recording],
    values: Mapping[str, float],
    free: Sequence[str],
    tolerance: float = TOLERANCE,
) -> list[Residual]:
    """Residual function of every run.

    values : of all parameters [SI]; those in `free` are among the unknowns
    """
    fixed = {n: v for n, v in values.items() if n not in free}
    return [residual_function(r, {**fixed, **r.logged_values}, tolerance) for r in recordings]


def whiten_functions(
    recordings: Sequence[Recording],
    values: Mapping[str, float],
    free: Sequence[str],
    near: Estimate,
) -> list[Residual] | None:
    """Residual function of every run, whitened for the noise of its measured input.

    near : the fit at which the effect of that noise is taken; other arguments as those of
        `residual_functions`
    None: the noise counts in no run.
    """
    noise = []
    for k, recording in enumerate(recordings):
        there = {**values, **recording.logged_values, **near.parameters(), **near.states(k)}
        noise.append(noise_directions(recording, *split_gap_position(there)))
    if not any(noise):
        return None
    plain = residual_functions(recordings, values, free)
    return [whiten_function(r, directions) for r, directions in zip(plain, noise, strict=True)]
