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

from plant_emulator.signals.frequency_bands import BANDS, power

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.diagnosis.prediction.trace import Trace
    from plant_emulator.signals.log import Array

# Elasticity shows from this frequency on [Hz].
ELASTIC_FREQUENCY = 10.0
BAND_WIDTHS = np.array([high - low for low, high in BANDS])


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


def unmodelled_remainder(
    model: Model, found: FitResult, fitted: Sequence[int], traces: Sequence[Trace]
) -> Remainder:
    """Remainder of the first channel after a fit.

    fitted : numbers of the fitted runs
    traces : of the held-out runs
    """
    first = traces[0]
    same = [t for t in traces if t.channel == first.channel]
    known = {model.runs[run].source for run in fitted}
    disjoint = known.isdisjoint(t.source for t in same)
    own = [_residual(model, found, k, run) for k, run in enumerate(fitted)] if disjoint else []
    return Remainder(
        channel=first.channel,
        unit=first.unit,
        before=_relative(same, [t.recalibrated for t in same]),
        after=_relative(same, [t.explained for t in same]),
        held_out=_power([(np.nan_to_num(t.measured - t.explained), t.time) for t in same]),
        fitted=_power(own) if disjoint else None,
    )


def _relative(traces: Sequence[Trace], predicted: Sequence[Array]) -> float:
    """Relative error norm(e) / norm(y) of predictions, over the samples that count [1]."""
    measured = np.concatenate([t.measured for t in traces])
    error = measured - np.concatenate(predicted)
    counts = np.isfinite(error)
    return float(np.linalg.norm(error[counts]) / np.linalg.norm(measured[counts]))


def _residual(model: Model, found: FitResult, k: int, run: int) -> tuple[Array, Array]:
    """Residual of the first channel of a fitted run [unit], and its time [s]."""
    measured = model.runs[run]
    whitened = model.residual(run, found.effects)({**found.values, **found.states[k]})
    return whitened[0] * measured.noise[0], measured.time


def _power(residuals: Sequence[tuple[Array, Array]]) -> Array:
    """Mean power of residuals in each of BANDS, weighted by their lengths [unit^2].

    residuals : each with its time [s]
    """
    each = [BAND_WIDTHS * power(e, float(np.mean(np.diff(time)))) for e, time in residuals]
    return np.average(each, axis=0, weights=[len(e) for e, _ in residuals])


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
