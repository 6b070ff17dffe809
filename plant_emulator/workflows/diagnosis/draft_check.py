"""Evaluates an effect file that a person wrote: joint fit and closed fraction of the gap."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from threadpoolctl import threadpool_limits

from plant_emulator import effects
from plant_emulator.diagnosis.answer import Quantity
from plant_emulator.diagnosis.execution.pool import InProcess, TaskRunner, build_model
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.missing_law.hypothesis_test import DraftedLaw, compare_laws, explains
from plant_emulator.diagnosis.wording import percent, size
from plant_emulator.errors import InputError
from plant_emulator.parameter_sets import DEFAULT, with_effects
from plant_emulator.recordings.recording import IMPOSSIBLE
from plant_emulator.workflows.arguments import check_choice
from plant_emulator.workflows.axis_files.own_effects import own_effects
from plant_emulator.workflows.diagnosis.axis_drafting import begin, try_effect
from plant_emulator.workflows.diagnosis.runs import axis_runs, bench_runs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.workflows.diagnosis.runs import Source

SCHEMA = "draft-check/1"


@dataclass(frozen=True, kw_only=True)
class DraftCheck:
    """Share of the held-out gap that an effect file closes; each log is held out in turn.

    mean_square : of the residual that the joint fit leaves, over the noise [1]; of an axis over
        what a rich model leaves
    explains : whether the effect explains a part of the logs that it was fitted to; else it is not
        tried on held-out logs
    """

    effect: str
    parameters: tuple[Quantity, ...]
    mean_square: float
    explains: bool
    held_out_gain: float | None
    held_out_gain_ci95: tuple[float, float] | None

    def to_json(self) -> dict[str, Any]:
        """The document `draft-check/1`."""
        return {
            "schema": SCHEMA,
            "effect": self.effect,
            "parameters": [vars(one) for one in self.parameters],
            "mean_square": self.mean_square,
            "held_out_gain": self.held_out_gain,
            "held_out_gain_ci95": self.held_out_gain_ci95,
        }

    def to_text(self) -> str:
        """A line for the share of the gap, and one for every size."""
        closed = "no gap that it could close"
        if not self.explains:
            closed = "explains no part of the logs that it was fitted to"
        if self.held_out_gain is not None and self.held_out_gain_ci95 is not None:
            low, high = map(percent, self.held_out_gain_ci95)
            closed = f"closes {percent(self.held_out_gain)} ({low} to {high}) of the held-out gap"
        left = f"leaves {self.mean_square:.3g} times the noise's squares"
        rows = [f"  {one.name} {size(one)}" for one in self.parameters]
        return "\n".join([f"{self.effect}: {closed}, {left}", *rows])

    def __str__(self) -> str:
        return self.to_text()


def draft_check(
    file: str | Path,
    logs: Sequence[Source],
    *,
    parameters: str | Path = DEFAULT,
    model: Literal["bench", "axis"] = "bench",
    columns: Sequence[str] | Mapping[str, str] = (),
) -> DraftCheck:
    """Fit the effect of a file to logs, and predict each log from the others with it.

    parameters : set of the bench; columns : of the files of an axis, see `diagnose`
    Raises InputError for a file, a log or a set that cannot be used, and for an effect that cannot
    be simulated.
    """
    check_choice("model", model, ("bench", "axis"))
    if model == "axis":
        return _of_axis(file, logs, columns)
    return _of_bench(file, logs, parameters)


def _of_axis(
    file: str | Path, logs: Sequence[Source], columns: Sequence[str] | Mapping[str, str]
) -> DraftCheck:
    (own,) = own_effects([file])
    runs = axis_runs(logs, (), columns=columns)
    held_out = begin(runs.recipe, runs.plan)
    found = try_effect(own, held_out)
    return DraftCheck(
        effect=own.name,
        parameters=tuple(
            replace(q, name=q.name.removeprefix(f"{own.name}_")) for q in found.ranked.parameters
        ),
        mean_square=found.fit.mean_square / held_out.regression.variance,
        explains=True,
        held_out_gain=found.gain,
        held_out_gain_ci95=found.interval,
    )


def _of_bench(file: str | Path, logs: Sequence[Source], parameters: str | Path) -> DraftCheck:
    (own,) = effects.from_files([Path(file)])
    runs = bench_runs(
        logs, (), with_effects.load(parameters), without=effects.names(), effect_files=[file]
    )
    model = build_model(runs.recipe)
    runner = TaskRunner(pool=InProcess(), recipe=runs.recipe, model=model, runs=runs.plan.fitted)
    with threadpool_limits(1):
        null = fit_null(model, runs.plan.fitted)
        draft = DraftedLaw(effect=own.name, values={}, null=null, runs=runs.plan.fitted)
        (found,) = compare_laws(runner, runs.plan, [draft])
    if found.fit.mean_square >= IMPOSSIBLE**2:
        raise InputError(
            f"{file}: the bench cannot be simulated with the plausible values of {own.name}; "
            "smaller ones are expected"
        )
    candidate = model.candidates[own.name]
    return DraftCheck(
        effect=own.name,
        parameters=tuple(
            Quantity(
                name=u.name.removeprefix(f"{own.name}_"),
                value=found.fit.values[u.name],
                standard_error=found.fit.standard_errors[u.name],
                unit=candidate.units[u.name],
            )
            for u in (*candidate.sizes, *candidate.shapes)
        ),
        mean_square=found.fit.mean_square,
        explains=explains(found.fit, null),
        held_out_gain=found.gain,
        held_out_gain_ci95=found.interval,
    )
