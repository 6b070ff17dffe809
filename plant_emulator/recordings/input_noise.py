"""Input noise (errors in variables): what the noise of a measured input does to a simulated run.

A log with a truck is simulated with its own wheel torque, which is measured. The torque that acted
differs from it by white noise of standard deviation s. So the whitened residual holds, beside the
noise of the sensors (variance 1), the response of the simulation to that noise n, to first order
B n, with

    covariance   I + B B',   B = U S V'

A column of B is the answer to the mean of the noise over a window of m samples, s / sqrt(m). It is
large where a gap closes a little earlier or later: a spike in the current and in the shaft torque,
ten times their noise. A fit that took such spikes for information on the machine gave drum_inertia
a tenth of its true standard error. Generalised least squares (Aitken, Proc. R. Soc. Edinburgh 55
(1935) 42) use the residual times

    (I + U S^2 U')^(-1/2) = I - U (1 - 1 / sqrt(1 + S^2)) U'

for the directions U in which S is above the noise of the sensors. Fainter ones are spread over the
whole run, and the covariance of an estimate takes them from the residual itself.

A wheel torque that nobody measured is estimated (`wheel_torque`). The error of the estimate is such
an input noise, with a large standard deviation. What it could explain tells nothing of the machine.
So is what is not known of an input in a hole of the log (`holes`), and of the reference at a row
that was taken early or late (`stamps`): on a ramp of 50 rad/s in 0.08 s it was off by 0.5 rad/s,
and the current by 15 times its noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import block_diag, csr_array

from plant_emulator.errors import UnsettledError
from plant_emulator.recordings.wheel_torque import ERROR, ERROR_WINDOW
from plant_emulator.signals.log import INPUT_ERRORS, WHEEL_TORQUE
from plant_emulator.signals.noise import noise

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Shorter than a gap takes to close [s]; its noise changes nothing within it.
NOISE_WINDOW = 0.25
# A log is taken in stretches. Their noise comes from the input within them and shortly before, so
# that a log twice as long takes twice as long, not four times [s].
STRETCH, INPUT_MEMORY = 10.0, 5.0
# Change of an unknown torque to which the simulation responds linearly [N m at the wheel].
ERROR_STEP = 10.0
# Time over which the error of an unknown torque may be the same [s].
TORQUE_ERROR_TIME = 1.0
# Standard deviation along a direction from which on it counts, in the noise of the sensors.
COUNTED_DEVIATION = 1.0
# Of the simulations: a direction need not be known better.
DIRECTION_TOLERANCE = 1e-3


@dataclass(frozen=True, kw_only=True)
class NoiseDirections:
    """Directions of a whitened residual in which input noise exceeds the noise of the sensors.

    directions : orthonormal, 0 where a sample does not count, shape (k, samples * channels), the
        channels of a sample side by side
    deviations : standard deviations of the input noise along them, over those of the sensors,
        shape (k,)
    known : 0 where no direction tells what the input noise does, else 1, shape (samples,); None:
        1 everywhere
    """

    directions: csr_array
    deviations: Array
    known: Array | None = None

    def along(self, residual: Array) -> Array:
        """Components of a residual, shape (channels, samples), along the directions, shape (k,)."""
        return np.asarray(self.directions @ residual.T.ravel())

    def whiten(self, residual: Array) -> Array:
        """The residual with noise of variance 1 in every direction, shape (channels, samples)."""
        residual = residual if self.known is None else residual * self.known
        taken = 1.0 - 1.0 / np.sqrt(1.0 + self.deviations**2)
        much = self.directions.T @ (taken * self.along(residual))
        return np.asarray(residual - much.reshape(residual.shape[::-1]).T)


def noise_directions(
    recording: Recording, values: Mapping[str, float], gap_position: float
) -> NoiseDirections | None:
    """Directions of the residual that what is unknown of the inputs disturbs; None: there are none.

    values : of the model [SI]; gap_position : at the start of the run, -1 to 1

    The slopes are differences over one standard deviation, because contact makes them uneven.
    Windows that are too far apart to meet in a stretch are simulated together. The response to one
    window must end within INPUT_MEMORY; a rest of it would add to the response to the next window.

    Where an error one way is no mirror of the other way, a contact comes and goes with it, and no
    sum of directions holds what it does: these samples do not count. A step of the reference that a
    hole hid left a hundred times the noise, whatever the machine was.
    """
    if not recording.uncertain_inputs:
        return None
    try:
        base = recording.strict_residual(values, gap_position, DIRECTION_TOLERANCE)
    except UnsettledError:
        return None
    length = _window(recording)
    window = length * recording.inputs.interval
    stretch, memory = (length * round(span / window) for span in (STRETCH, INPUT_MEMORY))
    answers = [
        factor * _answer(disturbed, values, gap_position, base)
        for disturbed, factor in _disturbed_torques(recording, length, stretch + memory)
    ]
    known = np.ones(base.shape[1])
    for pair in _disturbed_rows(recording):
        both = [_answer(disturbed, values, gap_position, base) for disturbed in pair]
        known[(np.abs(sum(both)) > 2.0 * COUNTED_DEVIATION).any(axis=0)] = 0.0
        answers += [0.5**0.5 * answer for answer in both]
    if not answers:
        return None
    answers = [answer * known for answer in answers]
    parts = [
        _strongest([answer[:, first : first + stretch] for answer in answers])
        for first in range(0, base.shape[1], stretch)
    ]
    if known.all() and not any(len(deviations) for _, deviations in parts):
        return None
    return NoiseDirections(
        directions=csr_array(block_diag([directions for directions, _ in parts])),
        deviations=np.concatenate([deviations for _, deviations in parts]),
        known=known,
    )


def _window(recording: Recording) -> int:
    """Samples of a window."""
    span = ERROR_WINDOW if recording.estimated_torque else NOISE_WINDOW
    return max(1, round(span / recording.inputs.interval))


def _answer(
    recording: Recording, values: Mapping[str, float], gap_position: float, base: Array
) -> Array:
    """Change of the whitened residual, shape (channels, samples).

    It is 0 where the simulation does not settle: nothing is known of these windows then.
    """
    try:
        return recording.strict_residual(values, gap_position, DIRECTION_TOLERANCE) - base
    except UnsettledError:
        return np.zeros_like(base)


def _disturbed_torques(
    recording: Recording, length: int, every: int
) -> list[tuple[Recording, float]]:
    """The recording with a wheel torque that is off, and the error's deviation over the change.

    In each, one window of every so many samples is off by a step: the first of them, the second
    one, and so on. Only samples change at which the truck is not parked and that a counting sample
    follows. An unknown torque may be off by far more than what the response is linear in, and for a
    second or the whole run as well: a wrong friction makes such an error. Independent windows would
    hardly have one together, and after a flight through the gap the response to it is not the sum
    of theirs.

    length : of a window [samples]; every : distance of the changed windows [samples]
    """
    run = recording.inputs
    if not run.truck:
        return []
    places = np.arange(len(run.time))
    last = np.flatnonzero(recording.use.any(axis=0)).max(initial=-1)
    acts = np.logical_not(run.parked)
    masks = [
        (places % every // length == k) & acts & (places <= last) for k in range(every // length)
    ]
    step = deviation = noise(recording.log[WHEEL_TORQUE]) / np.sqrt(length)
    if recording.estimated_torque:
        step, deviation = ERROR_STEP, ERROR
        second = (run.time - run.time[0]) // TORQUE_ERROR_TIME
        masks += [acts & (second == k) for k in np.unique(second)]
        masks.append(acts)
    return [
        (recording.with_wheel_torque(run.wheel_torque + step * mask), deviation / step)
        for mask in masks
        if mask.any()
    ]


def _disturbed_rows(recording: Recording) -> list[tuple[Recording, Recording]]:
    """The recording with an input that is off by its standard deviation at some rows, both ways.

    An input has one error in a hole, and one at each row whose time is not known. Those that are
    too far apart to meet in a stretch are in one recording. Each way has half of the variance,
    because a contact that comes early is no mirror of a late one.
    """
    stamped = recording.stamp_errors
    alone = [(row, row + 1) for row in np.flatnonzero(stamped).tolist()]
    found = _off_by(recording, "speed_reference", stamped, alone)
    for name, error in INPUT_ERRORS.items():
        if error in recording.log:
            deviation = recording.log[error]
            edges = np.flatnonzero(np.diff(deviation != 0.0, prepend=False, append=False))
            found += _off_by(recording, name, deviation, edges.reshape(-1, 2))
    return found


def _off_by(
    recording: Recording, name: str, deviation: Array, spans: Iterable[Sequence[int]]
) -> list[tuple[Recording, Recording]]:
    """The recording with an input off by its deviation in spans of rows, both ways, as above.

    spans : first row, and row behind the last one
    """
    time = recording.inputs.time
    together: list[tuple[float, Array]] = []
    for first, behind in spans:
        ended = (
            k for k, (end, _) in enumerate(together) if end < time[first] - STRETCH - INPUT_MEMORY
        )
        place = next(ended, None)
        off = np.zeros_like(deviation) if place is None else together.pop(place)[1]
        off[first:behind] = deviation[first:behind]
        together.append((time[behind - 1], off))
    return [
        (recording.with_input_off(name, off), recording.with_input_off(name, -off))
        for _, off in together
    ]


def _strongest(answers: Sequence[Array]) -> tuple[Array, Array]:
    """Directions, and deviations along them, in which responses exceed the noise of the sensors.

    answers : responses to the windows, each of shape (channels, n)
    """
    columns = np.stack([answer.T.ravel() for answer in answers], axis=1)
    _, deviations, windows = np.linalg.svd(columns, full_matrices=False)
    counted = deviations > COUNTED_DEVIATION
    # Not the decomposition's own left vectors: a sample that does not count stays exactly 0.
    return (columns @ windows[counted].T / deviations[counted]).T, deviations[counted]
