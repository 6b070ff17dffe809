"""One diagnosis of an axis, from logs to the findings.

1. The motion is smoothed, the force averaged with the kernel of the motion (`start`).
2. A queue over sets of effects ranks them by evidence (`search`).
3. The held-out runs confirm what is named (`held_out`, `verdict`).
4. The answer and the details of the report are put together (`answer`, `findings`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.axis import findings
from plant_emulator.diagnosis.axis.answer import answer
from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.floor import describe_floor, repeat_floor, sensor_floor
from plant_emulator.diagnosis.axis.held_out import HeldOut
from plant_emulator.diagnosis.axis.quantities import UNITS
from plant_emulator.diagnosis.axis.regression.fit import NAMES
from plant_emulator.diagnosis.axis.search import AxisSearch
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.diagnosis.axis.start import best_width, prepared, start
from plant_emulator.diagnosis.axis.verdict import decide
from plant_emulator.diagnosis.diagnose import Findings
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.report.details import Details
from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.axis.effects import Effect
    from plant_emulator.diagnosis.axis.effects.effect import Scale
    from plant_emulator.diagnosis.axis.known import KnownAxis
    from plant_emulator.diagnosis.axis.motion.run import Base, Motion
    from plant_emulator.diagnosis.axis.regression.fit import Fit, Regression
    from plant_emulator.diagnosis.axis.regression.rows import KnownEffect, Term
    from plant_emulator.diagnosis.execution.progress import Progress
    from plant_emulator.diagnosis.prediction.held_out import Plan
    from plant_emulator.signals.axis_log import AxisLog

# Searches at most: the width of the Coulomb friction is found anew beside the effects.
ROUNDS = 3
# Relative difference of two widths that are the same.
CLOSE = 0.1
# Thresholds of the verdict, for the report.
THRESHOLDS = {
    "gain of log evidence that an effect needs": f"{SETTINGS.needed:g}",
    "share that an effect has to close on held-out runs": f"{SETTINGS.worth:g}",
}


@dataclass(frozen=True)
class AxisRuns:
    """The runs of an axis, the fitted ones first.

    without : effects to take out of the library; own : the user's effects beside it
    known : the parameter set that is diagnosed, if there is one
    """

    logs: tuple[AxisLog, ...]
    without: tuple[str, ...] = ()
    own: tuple[Effect, ...] = ()
    known: KnownAxis | None = None

    @property
    def known_effects(self) -> tuple[KnownEffect, ...]:
        """Effects of the parameter set."""
        return self.known.effects if self.known else ()

    @property
    def effects(self) -> list[Effect]:
        """Effects that are tested: the user's own first, who knows the machine."""
        taken = (*self.without, *(one.term.effect.name for one in self.known_effects))
        return [one for one in (*self.own, *LIBRARY) if one.name not in taken]


@dataclass(frozen=True, kw_only=True)
class AxisResult(Findings):
    """The findings on an axis; base, scale : what the sizes of effects refer to."""

    base: Base
    scale: Scale


def diagnose_axis(
    runs: AxisRuns,
    plan: Plan,
    *,
    settings: Mapping[str, str],
    notes: Sequence[str] = (),
    progress: Progress | None = None,
) -> AxisResult:
    """Test the effects, predict the held-out runs; give the findings.

    progress : called with the label of each step and its done share [1]
    Raises LogError for logs that are too short, do not move, or are of two kinds of axes.
    """
    logs = runs.logs
    check_alike(logs)
    tell = progress or (lambda _label, _share: None)
    effects, known = runs.effects, runs.known_effects
    tell("reading the motion", 0.0)
    prepared_runs, scale = prepared(logs)
    _check_known(runs, prepared_runs[0].motion, scale)
    own = prepared_runs[: len(plan.fitted)]
    tell("testing effects", 0.3)
    width = 0.0
    terms: tuple[Term, ...] = ()
    for _ in range(ROUNDS):
        before, width = width, best_width(own, scale, terms, known)
        if abs(width - before) <= CLOSE * width:
            break
        scale = replace(scale, width=width)
        regression, rows, library = start(prepared_runs, scale, len(own), effects, width, known)
        search = AxisSearch(regression=regression, candidates=library, scale=scale)
        search.run()
        terms = search.best.terms
    tell("predicting held-out runs", 0.8)
    held_out = HeldOut(rows=rows, regression=regression, folds=plan.folds)
    repeats = repeat_floor(held_out)
    noise = sensor_floor(rows, regression.base.inertia)
    floor = max(noise, repeats or 0.0)
    decision = decide(search, held_out, noise, floor, runs.known)
    found = findings.AxisFindings(
        search=search,
        held_out=held_out,
        decision=decision,
        floor=floor,
        sources=tuple(log.source for log in logs),
        fitted=plan.fitted,
        candidates=effects,
        known=runs.known,
    )
    told = answer(found)
    tell("done", 1.0)
    return AxisResult(
        answer=told,
        details=Details(
            traces=findings.traces(found),
            waterfall=findings.waterfall(found),
            settings={**settings, **THRESHOLDS},
            notes=(*notes, describe_floor(floor, repeats, UNITS[scale.rotary]["offset"])),
            remainder=findings.remainder(found),
        ),
        final=fit_result(decision.found, regression),
        fixed={},
        base=decision.found.reference,
        scale=scale,
    )


def check_alike(logs: Sequence[AxisLog]) -> None:
    """Refuse logs of a linear and of a rotary axis together."""
    kinds = {False: "linear (m, N)", True: "rotary (rad, N m)"}
    for log in logs[1:]:
        if log.rotary != logs[0].rotary:
            raise LogError(
                f"{log.source}: {kinds[log.rotary]}, while {logs[0].source} is "
                f"{kinds[logs[0].rotary]}; logs of one axis are needed"
            )


def _check_known(runs: AxisRuns, motion: Motion, scale: Scale) -> None:
    """Refuse a parameter set of the other kind of axis, and of logs with other channels."""
    source = runs.logs[0].source
    if runs.known and runs.known.rotary != scale.rotary:
        raise LogError(
            f"{source}: a {'rotary' if scale.rotary else 'linear'} axis, while the parameter set "
            "is that of the other kind; a set of this axis is needed"
        )
    for one in (known.term.effect for known in runs.known_effects):
        rival = any(
            e is not one and e.name == one.name and e.applies(motion, scale) for e in LIBRARY
        )
        if rival and not one.applies(motion, scale):
            raise LogError(
                f"{source}: {one.name} of the parameter set ({one.title}) was found in logs with "
                "other channels; a log with the same channels is needed"
            )


def fit_result(fit: Fit, regression: Regression) -> FitResult:
    """A fit of the regression as every diagnosis has one."""
    errors = fit.covariance.diagonal() ** 0.5
    return FitResult(
        effects=fit.names,
        values=dict(zip(NAMES, map(float, fit.values), strict=False)),
        states=tuple({} for _ in regression.rows),
        cost=fit.cost,
        sum_of_squares=fit.cost,
        samples=fit.count,
        effective_fraction=regression.independent,
        standard_errors=dict(zip(NAMES, map(float, errors), strict=False)),
        converged=True,
    )
