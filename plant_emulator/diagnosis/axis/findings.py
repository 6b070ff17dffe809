"""The findings on an axis, and the details of its report that come from them alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.quantities import UNITS
from plant_emulator.diagnosis.prediction.remainder import Remainder
from plant_emulator.diagnosis.prediction.trace import Trace
from plant_emulator.diagnosis.report.details import Step
from plant_emulator.signals.frequency_bands import BANDS, power

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.effects.effect import Effect
    from plant_emulator.diagnosis.axis.held_out import HeldOut
    from plant_emulator.diagnosis.axis.known import KnownAxis
    from plant_emulator.diagnosis.axis.regression.rows import Term
    from plant_emulator.diagnosis.axis.search import AxisSearch
    from plant_emulator.diagnosis.axis.verdict import Decision
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class AxisFindings:
    """The results of the search and of the held-out runs of an axis.

    floor : rms of the force's error [N or N m]; see `floor`
    known : the parameter set, if there is one
    """

    search: AxisSearch
    held_out: HeldOut
    decision: Decision
    floor: float
    sources: tuple[str, ...]
    fitted: tuple[int, ...]
    candidates: Sequence[Effect]
    known: KnownAxis | None = None

    @property
    def rotary(self) -> bool:
        """Whether the axis turns."""
        return self.search.scale.rotary

    @property
    def channel(self) -> str:
        """Name of the force's channel."""
        return "torque" if self.rotary else "force"

    @property
    def terms(self) -> tuple[Term, ...]:
        """The named effects."""
        return self.decision.found.terms if self.decision.kind == "effect" else ()


def traces(f: AxisFindings) -> tuple[Trace, ...]:
    """The predicted runs, measured and predicted."""
    before, after = f.held_out.errors(()), f.held_out.errors(f.terms)
    return tuple(
        Trace(
            source=f.sources[run],
            channel=f.channel,
            unit=UNITS[f.rotary]["offset"],
            time=f.held_out.rows[run].time,
            measured=y,
            recalibrated=y - first,
            explained=y - second,
            noise=f.floor,
        )
        for run, y, first, second in zip(
            f.held_out.runs, f.held_out.measured(), before, after, strict=True
        )
    )


def nominal_errors(f: AxisFindings) -> list[Array]:
    """Force that the parameter set misses on the predicted runs, else the recalibrated model."""
    return f.held_out.nominal_errors(f.known.values) if f.known else f.held_out.errors(())


def remainder(f: AxisFindings) -> Remainder:
    """The unmodelled remainder beside the named effects, by frequency."""
    regression, found = f.search.regression, f.decision.found
    fitted = set(f.fitted).isdisjoint(f.held_out.runs)
    own = [(regression.residual(found, k), r.time) for k, r in enumerate(regression.rows)]
    after = f.held_out.errors(f.terms)
    times = [f.held_out.rows[k].time for k in f.held_out.runs]
    return Remainder(
        channel=f.channel,
        unit=UNITS[f.rotary]["offset"],
        before=f.held_out.relative(()),
        after=f.held_out.relative(f.terms),
        held_out=_power(list(zip(after, times, strict=True))),
        fitted=_power(own) if fitted else None,
    )


def waterfall(f: AxisFindings) -> tuple[Step, ...]:
    """The waterfall of the held-out gap, in multiples of the floor."""
    found = []
    if f.known:
        gap = float(np.sqrt(np.mean(np.concatenate(nominal_errors(f)) ** 2))) / f.floor
        found.append(Step(label="nominal", gap=gap, low=gap, high=gap))
    names = [t.effect.name for t in f.terms]
    for k in range(len(f.terms) + 1):
        label = (
            "recalibrated" if k == 0 else f"with {names[0]}" if k == 1 else f"and {names[k - 1]}"
        )
        e = np.concatenate(f.held_out.errors(f.terms[:k]))
        gap = float(np.sqrt(np.mean(e**2))) / f.floor
        found.append(Step(label=label, gap=gap, low=gap, high=gap))
    return (*found, Step(label="floor", gap=1.0, low=1.0, high=1.0))


def _power(residuals: Sequence[tuple[Array, Array]]) -> Array:
    """Mean power of residuals in each of BANDS, weighted by their lengths [unit^2]."""
    widths = np.array([high - low for low, high in BANDS])
    each = [widths * power(e, float(np.median(np.diff(time)))) for e, time in residuals]
    return np.average(each, axis=0, weights=[len(e) for e, _ in residuals])
