"""The drafts of an axis: missing laws, written as effect files and judged by held-out runs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import RankedEffect
from plant_emulator.diagnosis.axis.diagnose import fit_result
from plant_emulator.diagnosis.axis.held_out import HeldOut
from plant_emulator.diagnosis.axis.leftover import STATES
from plant_emulator.diagnosis.axis.quantities import quantities
from plant_emulator.diagnosis.axis.regression.rows import Term
from plant_emulator.diagnosis.axis.search import AxisSearch
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.diagnosis.axis.start import best_width, prepared, start
from plant_emulator.diagnosis.missing_law.axis_effect_text import axis_effect_text
from plant_emulator.diagnosis.missing_law.axis_quantities import SMOOTHED_INERTIA, axis_laws
from plant_emulator.diagnosis.missing_law.bound import Bound
from plant_emulator.diagnosis.missing_law.draft import sketches
from plant_emulator.diagnosis.missing_law.law_search import search
from plant_emulator.diagnosis.prediction.trace import Trace
from plant_emulator.workflows.axis_files.own_effects import own_effects
from plant_emulator.workflows.diagnosis.draft_files import effect_files, present, remove_rejected

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from plant_emulator.diagnosis.axis.diagnose import AxisRuns
    from plant_emulator.diagnosis.axis.effects import Effect
    from plant_emulator.diagnosis.axis.held_out import Share
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.missing_law.draft import Sketch
    from plant_emulator.diagnosis.missing_law.law_search import Law
    from plant_emulator.diagnosis.prediction.held_out import Plan

# Held-out gain from which on a law is drafted: as much as an effect of the library needs.
LEAST_GAIN = 2.0 * SETTINGS.needed


@dataclass(frozen=True, kw_only=True)
class AxisTest:
    """An effect of an axis after its test.

    ranked : the effect with sizes and shapes; terms, fit : of the fit to all fitted runs
    share : of the rms of the held-out error that the effect closes, the least certain of those with
        and without a shift of the stamps, and beside another inertia
    """

    ranked: RankedEffect
    terms: tuple[Term, ...]
    fit: FitResult
    share: Share

    @property
    def gain(self) -> float:
        """Share of the held-out squares that the effect closes [1]."""
        return of_squares(self.share.value)

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the gain."""
        return of_squares(self.share.low), of_squares(self.share.high)


@dataclass(frozen=True, kw_only=True)
class AxisDraft:
    """A drafted law of an axis, with the values of its fit, and its test."""

    sketch: Sketch
    law: Law
    file: Path
    test: AxisTest


def of_squares(share: float) -> float:
    """Share of the squares, of a share of the rms [1]."""
    return float(1.0 - (1.0 - share) * abs(1.0 - share))


@dataclass(frozen=True, kw_only=True)
class AxisDrafts:
    """The drafts of an axis, the best one first.

    bound : how much of the gap a curve or a draft closes
    traces : held-out runs, predicted without and with the best draft
    """

    drafts: tuple[AxisDraft, ...]
    bound: Bound
    traces: tuple[Trace, ...]


def draft_axis(runs: AxisRuns, plan: Plan, folder: Path) -> AxisDrafts:
    """Draft the missing law of an axis; its effect files land in the folder.

    Raises InputError where a file cannot be written.
    """
    held_out = begin(runs, plan)
    every = axis_laws(held_out.regression)
    before = every[0][1].null_loss()
    found = sketches([search(own, quantity, before) for quantity, own in every], LEAST_GAIN)
    already = present(folder)
    files = effect_files([one.law for one in found], lambda _, law: axis_effect_text(law), folder)
    tested = [_drafted(one, file, held_out) for one, file in zip(found, files, strict=True)]
    drafts = [
        one for one in tested if one.test.share.low > 0.0 and one.test.share.value > SETTINGS.worth
    ]
    drafts.sort(key=lambda one: SETTINGS.worth * len(one.law.terms) - one.test.share.value)
    kept: list[AxisDraft] = []
    for one in drafts:
        if not any(one.law.resembles(other.law) for other in kept):
            kept.append(one)
    remove_rejected(files, [one.file for one in kept], already)
    sources = [log.source for log in runs.logs]
    return AxisDrafts(
        drafts=tuple(kept),
        bound=_bound(held_out, kept),
        traces=_traces(held_out, sources, kept[0].test.terms) if kept else (),
    )


def begin(runs: AxisRuns, plan: Plan) -> HeldOut:
    """The held-out runs of an axis, and the regression of the fitted ones."""
    every, scale = prepared(runs.logs)
    own = every[: len(plan.fitted)]
    known = runs.known_effects
    width = best_width(own, scale, (), known)
    scale = replace(scale, width=width)
    regression, rows, _ = start(every, scale, len(own), runs.effects, width, known)
    return HeldOut(rows=rows, regression=regression, folds=plan.folds)


def _drafted(one: Sketch, file: Path, held_out: HeldOut) -> AxisDraft:
    """The law of a sketch after its test; file : with its effect."""
    (effect,) = own_effects([file])
    found = try_effect(effect, held_out)
    values = {q.name.removeprefix(f"{effect.name}_"): q.value for q in found.ranked.parameters}
    return AxisDraft(sketch=one, law=one.law.with_fitted_sizes(values), file=file, test=found)


def try_effect(effect: Effect, held_out: HeldOut) -> AxisTest:
    """Fit an effect, shapes and sizes, and predict the held-out runs with it."""
    regression = held_out.regression
    contest = AxisSearch(regression=regression, candidates=[effect], scale=regression.rows[0].scale)
    contest.sets[frozenset()] = regression.fit(())
    fit = contest.fit_set([effect.name])
    (term,) = fit.terms
    shares = [
        held_out.share((*fit.terms, *beside), beside, timing=shifted)
        for beside in ((), (SMOOTHED_INERTIA,))
        for shifted in (False, True)
    ]
    share = min(shares, key=lambda share: share.low)
    ranked = RankedEffect(
        effect=effect.name,
        subsystem=effect.subsystem,
        evidence=2.0 * contest.gain(fit),
        held_out_gain=of_squares(share.value),
        parameters=quantities(regression, fit, term),
        accepted=True,
    )
    return AxisTest(ranked=ranked, terms=fit.terms, fit=fit_result(fit, regression), share=share)


def _bound(held_out: HeldOut, drafts: Sequence[AxisDraft]) -> Bound:
    """The largest share of the held-out squares that a curve over a state, or a draft, closes."""
    curves = [*((Term(state),) for state in STATES), tuple(map(Term, STATES))]
    shares = [held_out.share(terms, ()) for terms in curves] + [one.test.share for one in drafts]
    low, high = (
        float(max(of_squares(getattr(share, end)) for share in shares)) for end in ("low", "high")
    )
    best = max(of_squares(share.value) for share in shares)
    return Bound(share=best, interval=(low, high))


def _traces(held_out: HeldOut, sources: Sequence[str], terms: Sequence[Term]) -> tuple[Trace, ...]:
    """The held-out runs, predicted without and with a draft."""
    first = held_out.rows[0]
    parts = zip(
        held_out.runs,
        held_out.measured(),
        held_out.errors(()),
        held_out.errors(terms),
        strict=True,
    )
    return tuple(
        Trace(
            source=sources[run],
            channel="torque" if first.scale.rotary else "force",
            unit="N m" if first.scale.rotary else "N",
            time=held_out.rows[run].time,
            measured=measured,
            recalibrated=measured - before,
            explained=measured - after,
            noise=float(np.sqrt(held_out.regression.variance)),
        )
        for run, measured, before, after in parts
    )
