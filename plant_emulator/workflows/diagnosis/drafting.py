"""The drafts of a diagnosis: missing laws, written as effect files and tried by simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator import effects
from plant_emulator.diagnosis.answer import Draft
from plant_emulator.diagnosis.execution.pool import TaskRunner, build_model
from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.machines.bench import BenchModel, BenchRecipe
from plant_emulator.diagnosis.missing_law.contest import Entry, hold
from plant_emulator.diagnosis.missing_law.draft import sketches
from plant_emulator.diagnosis.missing_law.effect_text import effect_text
from plant_emulator.diagnosis.missing_law.next_run import best_separation
from plant_emulator.errors import report_unwritable
from plant_emulator.simulation.simulate import values_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from plant_emulator.diagnosis.execution.pool import Pool
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.missing_law.contest import Result
    from plant_emulator.diagnosis.missing_law.draft import Sketch
    from plant_emulator.diagnosis.missing_law.law_search import Law
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.simulation.programs import SpeedProgram
    from plant_emulator.workflows.diagnosis.runs import Runs

# Share of the gap that a longer law has to close more than a shorter one.
WORTH_A_TERM = 0.02


@dataclass(frozen=True, kw_only=True)
class Drafted:
    """The drafts, the best one first, and the joint fit of each; see `answer.Draft`.

    next_program : the drive program that separates the two best drafts; None: there is one draft
    """

    drafts: tuple[Draft, ...] = ()
    fits: tuple[FitResult, ...] = ()
    next_program: SpeedProgram | None = None


def draft(runs: Runs, null: FitResult | None, pool: Pool, folder: Path) -> Drafted | None:
    """Draft the missing law of these runs of the bench; no drafts where no law closes a gap.

    null : converged fit without effects; None: it is made here
    folder : of the effect files, one a draft
    None: it cannot be done. The relations know the nominal equations of the bench only, without
    effects of a set; and other runs judge a law, so that a single run is not enough.
    Raises InputError where a file cannot be written.
    """
    recipe = runs.recipe
    if not isinstance(recipe, BenchRecipe) or recipe.parameters.effects or len(runs.fitted) < 2:
        return None
    if null is None:
        null = fit_null(BenchModel(runs.fitted, recipe.parameters, {}), range(len(runs.fitted)))
    found = sketches(runs.fitted, recipe.parameters, null)
    if not found:
        return Drafted()
    files = _write(found, folder)
    own = replace(recipe, without=_library(recipe), own=(*recipe.own, *files))
    runner = TaskRunner(pool=pool, recipe=own, model=build_model(own), runs=runs.plan.fitted)
    entries = [
        Entry(effect=file.stem, values=one.law.parameters, null=null, runs=runs.plan.fitted)
        for one, file in zip(found, files, strict=True)
    ]
    drafted = _ranked(found, files, hold(runner, runs.plan, entries))
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


def _write(found: Sequence[Sketch], folder: Path) -> list[Path]:
    """Write the effect file of every sketch."""
    files = []
    for number, one in enumerate(found, 1):
        file = (folder / f"draft_{one.law.quantity.place}_{number}.py").absolute()
        with report_unwritable(file):
            folder.mkdir(parents=True, exist_ok=True)
            file.write_text(effect_text(file.stem, one.law), encoding="utf-8")
        files.append(file)
    return files


def _ranked(found: Sequence[Sketch], files: Sequence[Path], results: Sequence[Result]) -> Drafted:
    """The drafts that certainly close a part of the held-out gap, the best one first."""
    rows = [
        (one, file, result)
        for one, file, result in zip(found, files, results, strict=True)
        if result.interval is not None and result.interval[0] > 0.0
    ]
    rows.sort(key=lambda row: WORTH_A_TERM * len(row[0].law.terms) - (row[2].gain or 0.0))
    forms = [_fitted(one, result).text for one, _, result in rows]
    return Drafted(
        drafts=tuple(
            _draft(one, file, result, tuple(f for f in forms if f != form))
            for (one, file, result), form in zip(rows, forms, strict=True)
        ),
        fits=tuple(result.fit for _, _, result in rows),
    )


def _fitted(one: Sketch, result: Result) -> Law:
    """The law with the values of its fit."""
    name = f"{result.effect}_"
    own = {k.removeprefix(name): v for k, v in result.fit.values.items() if k.startswith(name)}
    return one.law.fitted(own)


def _draft(one: Sketch, file: Path, result: Result, rivals: tuple[str, ...]) -> Draft:
    gain, interval, law = result.gain, result.interval, _fitted(one, result)
    drawn = law.over_state(one.curve.over, np.array(one.curve.knots))
    return Draft(
        place=law.quantity.place,
        quantity=law.quantity.name,
        over=", ".join(law.over) or "nothing",
        form=law.text,
        file=str(file),
        held_out_gain=gain,
        held_out_gain_ci95=interval,
        bound=None,
        bound_ci95=None,
        rivals=rivals,
        curve=replace(one.curve, law=None if drawn is None else tuple(drawn.tolist())),
    )
