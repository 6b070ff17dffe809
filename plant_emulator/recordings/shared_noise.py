"""The noise of a sensor is the same in all logs of one bench (pure).

Third differences take whatever changes from sample to sample for noise: a dead time that varies at
each scan, or a reference that is noisy itself. Such a log shows more noise than the sensor has. The
logs with the least noise therefore tell the noise of all that are sampled alike.

The third differences of n samples of white noise tell its deviation within the standard error

    1 / 2 sqrt(2 / n (1 + 2 sum rho^2)) = 1.07 / sqrt(n),    rho = -15/20, 6/20, -1/20

rho : autocorrelation of third differences at the lags 1, 2 and 3 (M. S. Bartlett, J. R. Statist.
Soc. Suppl. 8 (1946) 27)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.recordings.preflight import NOISY
from plant_emulator.signals.log import KNEE_TIME

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Standard error of a deviation times the square root of the samples, and so many of these errors
# that two logs of the same noise may be off, each to its side.
DEVIATION_ERROR, ERRORS = 1.07, 3.0
# Intervals between readings that differ by less than this ratio are alike.
FASTER = 1.4


def with_shared_noise(
    recordings: Sequence[Recording], fitted: int | None = None
) -> list[Recording]:
    """The recordings, each with the noise that its sensors show in the quietest of them.

    A log that shows only the rounding of its values, as where a coarse channel stands still, keeps
    that, and tells nothing of the others. A recording of a gateway keeps its own noise, which is
    that beside a simulation.

    fitted : so many recordings, the first ones, tell the noise of all; None: all of them do
    """
    found = [one.noise.copy() for one in recordings]
    for places in _alike(recordings):
        telling = [(k, c) for k, c in places if fitted is None or k < fitted]
        if telling:
            levels = np.array([recordings[k].noise[c] for k, c in telling])
            counts = np.array([np.count_nonzero(recordings[k].use[c]) for k, c in telling])
            level = _quietest(levels, counts)
            for k, c in places:
                found[k][c] = level
    return [one.with_noise(levels) for one, levels in zip(recordings, found, strict=True)]


def _alike(recordings: Sequence[Recording]) -> Iterator[list[tuple[int, int]]]:
    """Recordings and rows of each channel that shows noise, where its readings come alike fast.

    A sensor that is read faster changes less from reading to reading, whatever its noise is.
    """
    keyed = sorted(
        (name, float(np.median(np.diff(one.log.time[one.use[c]]))), k, c)
        for k, one in enumerate(recordings)
        if not one.estimated_torque and KNEE_TIME not in one.log
        for c, name in enumerate(one.channels)
        if one.noise[c] > NOISY * np.ptp(one.log[name])
    )
    group: list[tuple[int, int]] = []
    first: tuple[str, float] = ("", 0.0)
    for name, interval, k, c in keyed:
        if group and (name != first[0] or interval > FASTER * first[1]):
            yield group
            group = []
        if not group:
            first = name, interval
        group.append((k, c))
    if group:
        yield group


def _quietest(levels: Array, counts: Array) -> float:
    """Deviation that the quietest logs show together; counts : of samples, shape (n,) each."""
    off = ERRORS * DEVIATION_ERROR / np.sqrt(np.maximum(1, counts))
    most = float(np.min(levels * (1.0 + off)))
    quiet = levels * (1.0 - off) <= most
    return float(np.sqrt(np.average(levels[quiet] ** 2, weights=counts[quiet])))
