"""A channel of a held-out run beside its predictions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A channel of a held-out run, measured and predicted, shape (n,) each [unit].

    recalibrated : the same equations, parameters re-estimated; explained : with the effects named
        NaN where a sample does not count
    noise : standard deviation of the sensor's noise
    """

    source: str
    channel: str
    unit: str
    time: Array
    measured: Array
    recalibrated: Array
    explained: Array
    noise: float
