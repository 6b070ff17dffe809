"""What a machine modelled in outline leaves on held-out runs: how much, and where in frequency.

Such a model does not reach the noise, and a rest that no named effect explains has to be told. Its
size is the relative error norm(e) / norm(y), usual for inverse dynamic models; its place is the
band in which the held-out runs leave most beyond what the fitted ones do. Friction acts at the rate
of the motion itself; a rest above FAST is elasticity, or unknown.
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

FAST = 10.0
"""[Hz]"""
WIDTH = np.array([high - low for low, high in BANDS])


@dataclass(frozen=True, kw_only=True)
class Remainder:
    """What is left of one channel on the held-out runs.

    before, after : norm(e) / norm(y) without and with the effects named [1], both over the samples
        that count: the force at rest is whatever holds the machine
    held_out, fitted : power of the residual in each of BANDS [unit^2]; fitted None: where the
        held-out runs are the fitted ones in turn, there is nothing to compare with
    """

    channel: str
    unit: str
    before: float
    after: float
    held_out: Array
    fitted: Array | None

    @property
    def band(self) -> tuple[float, float]:
        """The band [Hz] that holds most of what the fitted runs do not leave as well."""
        excess = self.held_out if self.fitted is None else self.held_out - self.fitted
        return BANDS[int(np.argmax(excess))]


def rest_of(
    model: Model, found: FitResult, fitted: Sequence[int], traces: Sequence[Trace]
) -> Remainder:
    """The rest of the first channel after a fit, on the held-out runs behind the traces."""
    first = traces[0]
    same = [t for t in traces if t.channel == first.channel]
    known = {model.runs[run].source for run in fitted}
    apart = known.isdisjoint(t.source for t in same)
    own = [_residual(model, found, k, run) for k, run in enumerate(fitted)] if apart else []
    return Remainder(
        channel=first.channel,
        unit=first.unit,
        before=_relative(same, [t.recalibrated for t in same]),
        after=_relative(same, [t.explained for t in same]),
        held_out=_power([(np.nan_to_num(t.measured - t.explained), t.time) for t in same]),
        fitted=_power(own) if apart else None,
    )


def _relative(traces: Sequence[Trace], predicted: Sequence[Array]) -> float:
    """norm(e) / norm(y) of predictions over the samples that count [1]."""
    measured = np.concatenate([t.measured for t in traces])
    error = measured - np.concatenate(predicted)
    counts = np.isfinite(error)
    return float(np.linalg.norm(error[counts]) / np.linalg.norm(measured[counts]))


def _residual(model: Model, found: FitResult, k: int, run: int) -> tuple[Array, Array]:
    """Residual of the first channel of a fitted run [unit], and its time [s]."""
    there = model.runs[run]
    whitened = model.residual(run, found.effects)({**found.values, **found.states[k]})
    return whitened[0] * there.noise[0], there.time


def _power(residuals: Sequence[tuple[Array, Array]]) -> Array:
    """Power in each band, a mean over the runs by their lengths [unit^2]."""
    each = [WIDTH * power(e, float(np.mean(np.diff(time)))) for e, time in residuals]
    return np.average(each, axis=0, weights=[len(e) for e, _ in residuals])


def shrinks(rest: Remainder) -> str:
    """By how much the held-out error falls, as a part of a sentence."""
    return (
        f"the held-out {rest.channel} error norm(e)/norm(y) falls from {100.0 * rest.before:.2f} % "
        f"to {100.0 * rest.after:.2f} %"
    )


def lies(rest: Remainder) -> str:
    """Where the rest is, and what may cause it, as a part of a sentence."""
    low, high = rest.band
    cause = "elasticity, or unknown" if low >= FAST else "unknown"
    return f"the rest lies mainly at {low:g} to {high:g} Hz: {cause}"
