"""The noise of a sensor is the same in all logs of one bench (pure).

Third differences take whatever changes from sample to sample for noise: a dead time that varies at
each scan, or a reference that is noisy itself. Such a log shows more noise than the sensor has, and
no log shows less. The logs with the least noise therefore tell the noise of all.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.noise import FLOOR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.recordings.recording import Recording

# Share by which the estimates of one noise differ: four of their standard deviations, for logs of
# 20 s at 100 Hz.
SCATTER = 0.12


def with_shared_noise(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings, each with the noise that its sensors show in the quietest of them.

    A log that shows only the rounding of its values, as where a coarse channel stands still, keeps
    that, and tells nothing of the others.
    """
    found = [one.noise.copy() for one in recordings]
    for name in dict.fromkeys(name for one in recordings for name in one.channels):
        places = [
            (k, c)
            for k, one in enumerate(recordings)
            for c, channel in enumerate(one.channels)
            if channel == name and one.noise[c] > FLOOR * np.ptp(one.log[name])
        ]
        if not places:
            continue
        levels = np.array([recordings[k].noise[c] for k, c in places])
        quiet = levels[levels <= (1.0 + SCATTER) * levels.min()]
        for k, c in places:
            found[k][c] = np.sqrt(np.mean(quiet**2))
    return [replace(one, noise=levels) for one, levels in zip(recordings, found, strict=True)]
