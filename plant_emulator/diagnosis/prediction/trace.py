"""A channel of a held-out run beside its predictions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.machine import MeasuredRun
    from plant_emulator.diagnosis.prediction.gap import Prediction
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A channel of a held-out run, measured and predicted [unit], shape (n,) each.

    time : of the samples [s]
    recalibrated : prediction with the same equations and re-estimated parameters
    explained : prediction with the named effects
    noise : standard deviation of the sensor's noise [unit]
    A prediction is NaN where a sample does not count.
    """

    source: str
    channel: str
    unit: str
    time: Array
    measured: Array
    recalibrated: Array
    explained: Array
    noise: float


def traces(
    runs: Sequence[MeasuredRun], before: Sequence[Prediction], after: Sequence[Prediction]
) -> tuple[Trace, ...]:
    """Traces of all channels of the held-out runs that have samples that count.

    before, after : predictions without and with the named effects, one a fold
    """
    pairs = zip(
        runs,
        [r for prediction in before for r in prediction.residuals],
        [r for prediction in after for r in prediction.residuals],
        strict=True,
    )
    return tuple(
        Trace(
            source=run.source,
            channel=name,
            unit=run.units[k],
            time=run.time,
            measured=run.measured[k],
            recalibrated=_prediction(run, k, first),
            explained=_prediction(run, k, second),
            noise=float(run.noise[k]),
        )
        for run, first, second in pairs
        for k, name in enumerate(run.channels)
        if first[k].any()
    )


def _prediction(run: MeasuredRun, channel: int, residual: Array) -> Array:
    """Prediction behind a whitened residual [unit]; NaN where a sample does not count.

    The prediction of a voltage contains the error of its sensor.
    """
    whitened = np.where(residual[channel] == 0.0, np.nan, residual[channel])
    deviation = run.noise[channel] * run.noise_ratio[channel]
    return np.asarray(run.measured[channel] - whitened * deviation)
