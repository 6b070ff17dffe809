"""The unmodelled remainder of a machine that is modelled in outline: its size and its band.

The model of such a machine does not reach the noise. What no named effect explains is the
remainder; its size is the relative error that is usual for inverse dynamic models,

    norm(e) / norm(y)     e : residual, y : measured channel

Its place is the frequency band in which the held-out runs leave most beyond the fitted runs.
Friction acts at the rate of the motion itself. A remainder above ELASTIC_FREQUENCY is elasticity,
or unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.frequency_bands import BANDS

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

# Elasticity shows from this frequency on [Hz].
ELASTIC_FREQUENCY = 10.0


@dataclass(frozen=True, kw_only=True)
class Remainder:
    """The unmodelled remainder of one channel on the held-out runs.

    before, after : norm(e) / norm(y) without and with the named effects [1]; a sample at rest does
        not count, because the force at rest is whatever holds the machine
    held_out : power of the residual in each of BANDS on the held-out runs [unit^2]
    fitted : the same power on the fitted runs; None: the held-out runs are fitted in turn
    """

    channel: str
    unit: str
    before: float
    after: float
    held_out: Array
    fitted: Array | None

    @property
    def band(self) -> tuple[float, float]:
        """Band that holds most of the power beyond that of the fitted runs [Hz]."""
        excess = self.held_out if self.fitted is None else self.held_out - self.fitted
        return BANDS[int(np.argmax(excess))]


def describe_fall(rest: Remainder) -> str:
    """Say by how much the held-out error falls, as a part of a sentence."""
    return (
        f"the held-out {rest.channel} error norm(e)/norm(y) falls from {100.0 * rest.before:.2f} % "
        f"to {100.0 * rest.after:.2f} %"
    )


def describe_band(rest: Remainder) -> str:
    """Say where in frequency the remainder lies and what may cause it, as a part of a sentence."""
    low, high = rest.band
    cause = "elasticity, or unknown" if low >= ELASTIC_FREQUENCY else "unknown"
    return f"the rest lies mainly at {low:g} to {high:g} Hz: {cause}"
