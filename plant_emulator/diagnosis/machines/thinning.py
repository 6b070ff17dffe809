"""A recording at the samples that parity relations can use (pure).

A relation between two samples needs all channels at both. Where a channel is sampled and held, only
its new values count, so that the recording is thinned to them. A sample that does not count is
bridged by a straight line, and its relations are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.simulation.run_inputs import inputs_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.recordings.recording import Recording

# Share of a channel's samples that are new, below which it is sampled and held.
NEW_SHARE = 0.6
# Least share of the samples that a thinned recording has.
LEAST_KEPT_SHARE = 0.1
# A step of time over the usual one that hides what happens in it.
HIDING_STEP = 2.5


@dataclass(frozen=True, kw_only=True)
class Thinned:
    """A thinned recording; void : samples that do not count in some channel, shape (n,)."""

    recording: Recording
    void: NDArray[np.bool_]

    @property
    def usable_intervals(self) -> NDArray[np.bool_]:
        """Intervals whose relations count, shape (n - 1,)."""
        step = np.diff(self.recording.log.time)
        return np.asarray(
            ~(self.void[1:] | self.void[:-1] | (step > HIDING_STEP * np.median(step)))
        )


def thin(recording: Recording, use: NDArray[np.bool_]) -> Thinned:
    """Thin a recording; use : samples that count, shape (channels, n)."""
    log = recording.log
    held = [k for k, own in enumerate(use) if np.mean(own) < NEW_SHARE]
    kept = np.all(use[held], axis=0) if held else np.ones(len(log.time), bool)
    if np.mean(kept) < LEAST_KEPT_SHARE:
        kept = np.ones(len(log.time), bool)
    use = use[:, kept]
    void = np.asarray(~use.all(axis=0))
    if kept.all() and use.all():
        return Thinned(recording=recording, void=void)
    time = log.time[kept]
    signals = {name: np.ascontiguousarray(log[name][kept]) for name in log.signals}
    for name, own in zip(recording.channels, use, strict=True):
        if not own.all() and own.any():
            signals[name] = np.interp(time, time[own], signals[name][own])
    sparse = replace(log, time=time, signals=signals)
    inputs = recording.inputs if kept.all() else inputs_of(sparse)
    found = replace(recording, log=sparse, inputs=inputs, use=use)
    return Thinned(recording=found, void=void)
