"""The drafts of a diagnosis: missing laws, written as effect files and tried by simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator import effects
from plant_emulator.diagnosis.answer import Draft
from plant_emulator.diagnosis.axis.diagnose import AxisRuns
from plant_emulator.diagnosis.execution.pool import TaskRunner, build_model
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit_from
from plant_emulator.diagnosis.machines.bench import BenchModel, BenchRecipe
from plant_emulator.diagnosis.missing_law.bound import Bound
from plant_emulator.diagnosis.missing_law.draft import sketch
from plant_emulator.diagnosis.missing_law.effect_text import effect_text
from plant_emulator.diagnosis.missing_law.hypothesis_test import (
    WORTH_A_TERM,
    DraftedLaw,
    compare_laws,
)
from plant_emulator.diagnosis.missing_law.next_run import best_separation
from plant_emulator.simulation.simulate import values_of
from plant_emulator.workflows.diagnosis.axis_drafting import draft_axis
from plant_emulator.workflows.diagnosis.draft_files import effect_files, present, remove_rejected

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.answer import RankedEffect
    from plant_emulator.diagnosis.execution.pool import Pool
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.missing_law.draft import Sketch, Sketchbook
    from plant_emulator.diagnosis.missing_law.hypothesis_test import LawResult
    from plant_emulator.diagnosis.missing_law.law_search import Law
    from plant_emulator.diagnosis.prediction.trace import Trace
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.simulation.programs import SpeedProgram
    from plant_emulator.workflows.diagnosis.axis_drafting import AxisDrafts
    from plant_emulator.workflows.diagnosis.runs import Runs


@dataclass(frozen=True, kw_only=True)
class Drafted:
    """The drafts, the best one first, and the joint fit of each; see `answer.Draft`.

    bound : how much of the gap any law could close; None: the relations show no gap
    traces : held-out runs, predicted without and with the best draft
    next_program : the drive program that separates the two best drafts; None: there is one draft,
        or the machine is an axis
    of_axis : the drafts of an axis as effects
    """

    drafts: tuple[Draft, ...] = ()
    fits: tuple[FitResult, ...] = ()
    bound: Bound | None = None
    traces: tuple[Trace, ...] = ()
    next_program: SpeedProgram | None = None
    of_axis: tuple[RankedEffect, ...] = ()


def draft(runs: Runs[Any], null: FitResult | None, pool: Pool, folder: Path) -> Drafted | None:
    """Draft the missing law of these runs; no drafts where no law closes a gap.

    null : fit of the bench without effects, in any noise; None: it is made here
    folder : of the effect files, one a draft
    None: it cannot be done. The relations know the nominal equations of the bench only, without
    effects of a set; and other runs judge a law, so that a single run is not enough.
    Raises InputError where a file cannot be written.
    """
    recipe = runs.recipe
    if isinstance(recipe, AxisRuns):
        return _of_axis(draft_axis(recipe, runs.plan, folder))
    if not isinstance(recipe, BenchRecipe) or recipe.parameters.effects or len(runs.fitted) < 2:
        return None
    # The costs of the drafts count in the declared noise at first, and so does the fit without one.
    plain, every = BenchModel(runs.fitted, recipe.parameters, {}), range(len(runs.fitted))
    null = fit_null(plain, every) if null is None else fit_from(plain, (), every, null)
    book = sketch(runs.fitted, recipe.parameters, null)
    found = book.sketches
    if not found:
        return Drafted(bound=book.bound)
    before = present(folder)
    files = effect_files([one.law for one in found], effect_text, folder)
    own = replace(recipe, without=_library(recipe), own=(*recipe.own, *files))
    runner = TaskRunner(pool=pool, recipe=own, model=build_model(own), runs=runs.plan.fitted)
    alternatives = [
        DraftedLaw(
            effect=file.stem,
            values=one.parameters,
            null=null,
            runs=runs.plan.fitted,
            states=one.law.phases,
        )
        for one, file in zip(found, files, strict=True)
    ]
    drafted = _rank(book, files, compare_laws(runner, runs.plan, alternatives))
    kept = [Path(one.file) for one in drafted.drafts]
    remove_rejected(files, kept, before)
    replace(recipe, own=(*recipe.own, *kept)).build()  # else this process knows files that are gone
    return replace(drafted, next_program=_next_program(runs.fitted, recipe, drafted.fits))


def _next_program(
    recordings: Sequence[Recording], recipe: BenchRecipe, fits: Sequence[FitResult]
) -> SpeedProgram | None:
    """The drive program in which the two best drafts differ most."""
    if len(fits) < 2:
        return None
    known = values_of(recipe.parameters)
    one, other = ({**known, **fit.values, **fit.states[-1]} for fit in fits[:2])
    found = best_separation(recordings, one, other)
    return None if found is None else found.program


def _library(recipe: BenchRecipe) -> tuple[str, ...]:
    """Names of all effects beside the drafts."""
    return (*effects.names(), *(file.stem for file in recipe.own))


def _of_axis(found: AxisDrafts) -> Drafted:
    """The drafts of an axis."""
    texts = [one.law.text for one in found.drafts]
    return Drafted(
        drafts=tuple(
            _draft(
                (one.sketch, one.law, one.file),
                (one.test.gain, one.test.interval),
                found.bound,
                (*texts[:k], *texts[k + 1 :]),
            )
            for k, one in enumerate(found.drafts)
        ),
        fits=tuple(one.test.fit for one in found.drafts),
        bound=found.bound,
        traces=found.traces,
        of_axis=tuple(one.test.ranked for one in found.drafts),
    )


def _rank(book: Sketchbook, files: Sequence[Path], results: Sequence[LawResult]) -> Drafted:
    """The drafts that certainly close a part of the held-out gap worth their terms, best first.

    Of two laws that the fit has made alike, the better one stays.
    """
    rows = [
        (one, _insert_fitted_values(one, result), file, result)
        for one, file, result in zip(book.sketches, files, results, strict=True)
        if result.is_draft(len(one.law.terms))
    ]
    rows.sort(key=lambda row: WORTH_A_TERM * len(row[1].terms) - (row[3].gain or 0.0))
    kept: list[tuple[Sketch, Law, Path, LawResult]] = []
    for row in rows:
        if not any(row[1].resembles(other[1]) for other in kept):
            kept.append(row)
    best = _with_drafts(book.bound, [result for *_, result in kept])
    return Drafted(
        drafts=tuple(
            _draft(
                row[:3],
                (row[3].gain, row[3].interval),
                best,
                tuple(other[1].text for other in kept if other is not row),
            )
            for row in kept
        ),
        fits=tuple(result.fit for *_, result in kept),
        bound=best,
        traces=kept[0][-1].traces if kept else (),
    )


def _with_drafts(found: Bound | None, results: Sequence[LawResult]) -> Bound | None:
    """The bound, or what the drafts close by simulation where that is more."""
    closed = [
        Bound(share=result.gain, interval=result.interval)
        for result in results
        if result.gain is not None and result.interval is not None
    ]
    every = [*closed, *([] if found is None else [found])]
    if not every:
        return None
    low, high = (max(one.interval[end] for one in every) for end in (0, 1))
    return Bound(share=max(one.share for one in every), interval=(low, high))


def _insert_fitted_values(one: Sketch, result: LawResult) -> Law:
    """The law with the values of its fit."""
    name = f"{result.effect}_"
    own = {k.removeprefix(name): v for k, v in result.fit.values.items() if k.startswith(name)}
    return one.law.with_fitted_sizes(own)


def _draft(
    told: tuple[Sketch, Law, Path],
    gain: tuple[float | None, tuple[float, float] | None],
    bound: Bound | None,
    rivals: tuple[str, ...],
) -> Draft:
    one, law, file = told
    drawn = law.over_state(one.curve.over, np.array(one.curve.knots))
    return Draft(
        place=law.quantity.place,
        quantity=law.quantity.name,
        over=", ".join(law.over) or "nothing",
        form=law.text,
        file=str(file),
        held_out_gain=gain[0],
        held_out_gain_ci95=gain[1],
        bound=None if bound is None else bound.interval[1],
        bound_ci95=None if bound is None else bound.interval,
        rivals=rivals,
        curve=replace(one.curve, law=None if drawn is None else tuple(drawn.tolist())),
    )
