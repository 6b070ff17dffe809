"""The steps of a contest: each a function of a model and plain data, for a pool to run."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.elsewhere import (
    from_nominal,
    in_place,
    shaken,
    sifted,
    smoothed,
    vacated,
)
from plant_emulator.diagnosis.fitting.joint_fit import (
    TRIAL_ITERATIONS,
    fit_from,
    fit_null,
    linearise,
    to_result,
)
from plant_emulator.diagnosis.fitting.looks import glance, glance_far, look, patient
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace, nuisance_space
from plant_emulator.diagnosis.fitting.signature import signature
from plant_emulator.diagnosis.fitting.task import Task

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.signature import Signature
    from plant_emulator.diagnosis.machine import Model


def start(model: Model, runs: tuple[int, ...]) -> FitResult:
    """The fit without effects."""
    return fit_null(model, runs)


def spread(model: Model, task: Task) -> FitResult:
    """A fit of some runs as it is on all, their states looked for."""
    base, known = task.base, dict(zip(task.known, task.base.states, strict=True))
    states = tuple(
        known[k] if k in known else model.initial_states(k, base.effects, base.values)
        for k in task.runs
    )
    found = linearise(model, replace(base, states=states), task.runs)
    return to_result(base.effects, found, len(task.runs))


def show(model: Model, task: Task) -> Signature | None:
    """The signature of an effect; None where it changes nothing, or nothing that a fit can tell."""
    if model.candidates[task.effect].stochastic:
        return None
    return signature(model, task.effect, task.base, task.runs, _tangents(model, task))


def contend(model: Model, task: Task) -> FitResult:
    """A first look at the joint fit of an effect from its signature."""
    assert task.signature is not None
    near = _tangents(model, task).estimate
    return glance(model, task.signature, task.base, task.runs, near)


def contend_far(model: Model, task: Task) -> FitResult | None:
    """A first look at the joint fit of an effect, from the larger size of its signature."""
    assert task.signature is not None
    near = _tangents(model, task).estimate
    return glance_far(model, task.signature, task.base, task.runs, near)


def plod(model: Model, task: Task) -> FitResult:
    """The joint fit of an effect with more steps, from a size on either side."""
    assert task.signature is not None
    return patient(model, task.signature, task.base, task.runs)


def follow(model: Model, task: Task) -> FitResult:
    """A few steps more of `task.base`'s fit."""
    return look(model, task.base.effects, task.runs, task.base)


def shake(model: Model, task: Task) -> FitResult:
    """The fit of `task.base` from some way off, or, number 0, with wide slopes."""
    if task.number == 0:
        return smoothed(model, task.base.effects, task.runs, task.base)
    return shaken(model, task.base.effects, task.runs, task.base, task.number)


def sift(model: Model, task: Task) -> FitResult:
    """The fit of `task.base` from the best values of each of its unknowns."""
    return sifted(model, task.base.effects, task.runs, task.base)


def swap(model: Model, task: Task) -> tuple[float, FitResult]:
    """The start of `task.effect` in the place of the last of `task.base`, and its loss."""
    place = Task(base=vacated(model, task.base), runs=task.runs)
    return in_place(model, task.effect, task.base, task.runs, _tangents(model, place))


def once_more(model: Model, task: Task) -> FitResult:
    """The joint fit of an effect from the nominal parameters."""
    return from_nominal(model, task.effect, task.base, task.runs)


def advance(model: Model, task: Task) -> FitResult:
    """Some steps of the fit of `task.base` from its values."""
    return fit_from(model, task.base.effects, task.runs, task.base, TRIAL_ITERATIONS)


def refit(model: Model, task: Task) -> FitResult:
    """The fit of `task.base` with the effects named there, from its values."""
    return fit_from(model, task.base.effects, task.runs, task.base)


def _tangents(model: Model, task: Task) -> NuisanceSpace:
    return nuisance_space(model, task.base, task.runs)
