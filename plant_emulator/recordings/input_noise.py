"""What the noise of an input that is fed as measured does to a simulated run.

A log with a truck is simulated with its own wheel torque, and that is measured: what acted differs
from it by white noise of a standard deviation s. Beside the noise of the sensors, of variance 1,
the whitened residual then holds what this makes of the simulation, to first order B n,

    covariance   I + B B',   B = U S V'

A column of B is the answer to the mean of the noise over a window of m samples, s / sqrt(m). It is
large where a gap closes a little earlier or later: a spike in the current and in the shaft torque,
ten times their noise. Taken as if it told of the machine it gave drum_inertia a standard error a
tenth of the true one. Generalised least squares (Aitken, Proc. R. Soc. Edinburgh 55 (1935) 42) use
the residual times

    (I + U S^2 U')^(-1/2) = I - U (1 - 1 / sqrt(1 + S^2)) U'

for the directions U in which S is above the noise of the sensors. Fainter ones are spread over the
whole run, and the covariance of an estimate takes them from the residual itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import block_diag, csr_array

from plant_emulator.errors import UnsettledError
from plant_emulator.signals.noise import noise

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Shorter than a gap takes to close [s]; its noise changes nothing within it.
WINDOW = 0.25
# A log is taken in stretches, whose noise comes from within and from what was fed shortly before:
# one twice as long takes twice as long, not four times [s].
STRETCH, MEMORY = 10.0, 5.0
# Standard deviation along a direction from which on it counts, in the noise of the sensors.
COUNTED_DEVIATION = 1.0
# Of the simulations: a direction need not be known better.
TOLERANCE = 1e-4


@dataclass(frozen=True, kw_only=True)
class NoiseDirections:
    """Directions of a run's whitened residual in which a fed input is louder than the sensors.

    directions : orthonormal, 0 where a sample does not count, shape (k, samples * channels), the
        channels of a sample side by side
    deviations : of the fed input's noise along them, over that of the sensors, shape (k,)
    """

    directions: csr_array
    deviations: Array

    def along(self, residual: Array) -> Array:
        """Components of a residual, shape (channels, samples), along the directions, shape (k,)."""
        return np.asarray(self.directions @ residual.T.ravel())

    def whitened(self, residual: Array) -> Array:
        """The residual with noise of variance 1 in every direction, shape (channels, samples)."""
        taken = 1.0 - 1.0 / np.sqrt(1.0 + self.deviations**2)
        much = self.directions.T @ (taken * self.along(residual))
        return np.asarray(residual - much.reshape(residual.shape[::-1]).T)


def noise_directions(
    recording: Recording, values: Mapping[str, float], gap_position: float
) -> NoiseDirections | None:
    """What the noise of the wheel torque does to a run at these values; None: nothing that counts.

    The slopes are differences over one standard deviation: contact makes them uneven. Windows too
    far apart to meet in a stretch are simulated together: an answer has to end within MEMORY, else
    what is left of it adds to that of the next.
    """
    if not recording.inputs.truck:
        return None
    try:
        base = recording.strict_residual(values, gap_position, TOLERANCE)
    except UnsettledError:
        return None
    length = max(1, round(WINDOW / recording.inputs.interval))
    stretch, memory = (length * round(span / WINDOW) for span in (STRETCH, MEMORY))
    answers = [
        _answer(recording.with_wheel_torque(torque), values, gap_position, base)
        for torque in _disturbed(recording, length, stretch + memory)
    ]
    if not answers:
        return None
    parts = [
        _loudest([answer[:, first : first + stretch] for answer in answers])
        for first in range(0, base.shape[1], stretch)
    ]
    if not any(len(deviations) for _, deviations in parts):
        return None
    return NoiseDirections(
        directions=csr_array(block_diag([directions for directions, _ in parts])),
        deviations=np.concatenate([deviations for _, deviations in parts]),
    )


def _answer(
    recording: Recording, values: Mapping[str, float], gap_position: float, base: Array
) -> Array:
    """Change of the whitened residual; 0 where the simulation does not settle, which tells nothing
    of these windows.
    """
    try:
        return recording.strict_residual(values, gap_position, TOLERANCE) - base
    except UnsettledError:
        return np.zeros_like(base)


def _disturbed(recording: Recording, length: int, every: int) -> list[Array]:
    """The wheel torque with the mean of the first window of every so many samples off by a standard
    deviation, then that of the second, and so on; only where the truck is not parked and a sample
    that counts comes after.
    """
    run = recording.inputs
    step = noise(recording.log["wheel_torque"]) / np.sqrt(length)
    places = np.arange(len(run.time))
    last = np.flatnonzero(recording.use.any(axis=0)).max(initial=-1)
    acts = np.logical_not(run.parked) & (places <= last)
    masks = [(places % every // length == k) & acts for k in range(every // length)]
    return [run.wheel_torque + step * mask for mask in masks if mask.any()]


def _loudest(answers: Sequence[Array]) -> tuple[Array, Array]:
    """Directions in which answers, each of shape (channels, n), are louder than the sensors."""
    columns = np.stack([answer.T.ravel() for answer in answers], axis=1)
    _, deviations, windows = np.linalg.svd(columns, full_matrices=False)
    counted = deviations > COUNTED_DEVIATION
    # Not the decomposition's own left vectors: a sample that does not count stays exactly 0.
    return (columns @ windows[counted].T / deviations[counted]).T, deviations[counted]
