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

from plant_emulator.errors import UnsettledError
from plant_emulator.noise import noise

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.log import Array
    from plant_emulator.recording import Recording

# Shorter than a gap takes to close [s]; its noise changes nothing within it.
WINDOW = 0.25
# Standard deviation along a direction from which on it counts, in the noise of the sensors.
LOUD = 1.0
# Of the simulations: a direction need not be known better.
TOLERANCE = 1e-4


@dataclass(frozen=True, kw_only=True)
class Loud:
    """Directions of a run's whitened residual in which a fed input is louder than the sensors.

    directions : orthonormal, 0 where a sample does not count, shape (k, channels, samples)
    deviations : of the fed input's noise along them, over that of the sensors, shape (k,)
    """

    directions: Array
    deviations: Array

    def quieted(self, residual: Array) -> Array:
        """The residual with noise of variance 1 in every direction, shape (channels, samples)."""
        taken = 1.0 - 1.0 / np.sqrt(1.0 + self.deviations**2)
        along = np.tensordot(self.directions, residual, axes=2)
        return np.asarray(residual - np.tensordot(taken * along, self.directions, axes=1))


def loud(recording: Recording, values: Mapping[str, float], gap_position: float) -> Loud | None:
    """What the noise of the wheel torque does to a run at these values; None: nothing that counts.

    The slopes are differences over one standard deviation: contact makes them uneven.
    """
    if not recording.run.truck:
        return None
    base = _settled(recording, values, gap_position)
    if base is None:
        return None
    every = (
        _settled(recording.fed(torque), values, gap_position) for torque in _disturbed(recording)
    )
    answers = [found - base for found in every if found is not None]
    if not answers:
        return None
    columns = np.stack([answer.ravel() for answer in answers], axis=1)
    _, deviations, windows = np.linalg.svd(columns, full_matrices=False)
    counted = deviations > LOUD
    if not counted.any():
        return None
    # Not the decomposition's own left vectors: a sample that does not count stays exactly 0.
    directions = (columns @ windows[counted].T / deviations[counted]).T
    return Loud(
        directions=directions.reshape(-1, *base.shape),
        deviations=np.asarray(deviations[counted]),
    )


def _settled(
    recording: Recording, values: Mapping[str, float], gap_position: float
) -> Array | None:
    """The whitened residual; None where the simulation does not settle, which tells nothing."""
    try:
        return recording.settled(values, gap_position, TOLERANCE)
    except UnsettledError:
        return None


def _disturbed(recording: Recording) -> list[Array]:
    """The wheel torque with the mean of a window off by a standard deviation, for each window that
    a sample which counts comes after.
    """
    run = recording.run
    length = max(1, round(WINDOW / run.interval))
    step = noise(recording.log["wheel_torque"]) / np.sqrt(length)
    starts = range(0, len(run.time), length)
    acts = [
        k for k in starts if recording.use[:, k:].any() and not run.parked[k : k + length].all()
    ]
    places = np.arange(len(run.time))
    return [run.wheel_torque + step * ((places >= k) & (places < k + length)) for k in acts]
