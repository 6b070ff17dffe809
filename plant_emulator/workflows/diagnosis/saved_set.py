"""The parameter set that a diagnosis leaves: fitted parameters, and the accepted effects.

The set of an axis has the form of a bench's set, with the parameters of the axis.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.quantities import UNITS
from plant_emulator.estimation.initial_states import with_logged_values
from plant_emulator.model.parameters import Parameter, ParameterSet
from plant_emulator.solver.kernel import kernel
from plant_emulator.workflows.diagnosis.axis_set import reference_entries
from plant_emulator.workflows.provenance import program_version, today

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.axis.diagnose import AxisResult
    from plant_emulator.diagnosis.diagnose import Findings
    from plant_emulator.effects import Effect
    from plant_emulator.recordings.recording import Recording

SYMBOLS = {"inertia": "M", "viscous_friction": "F_v", "coulomb_friction": "F_c", "offset": "F_0"}


def parameter_set(
    findings: Findings,
    parameters: ParameterSet,
    recordings: Sequence[Recording],
    files: Mapping[str, str],
) -> ParameterSet:
    """The given set with the fitted values and the effects of the final fit.

    A value that every run has of its own becomes the mean of the runs.
    parameters : the set as given; recordings : the runs that were fitted
    files : of the effects that are not shipped, by effect
    """
    final, named = findings.final, tuple(findings.fixed)
    own = {name: dict(findings.fixed[name]) for name in named}
    for name in named:
        effect = kernel().effects[name]
        fitted = {key: final.values.get(f"{name}_{key}") for key in effect.parameters}
        own[name] |= {key: value for key, value in fitted.items() if value is not None}
        own[name] |= _of_runs(effect, final.states, recordings)
    changed = {n: v for n, v in final.values.items() if n in parameters.parameters}
    new = parameters.with_values(changed)
    kept = {
        name: replace(p, standard_error=final.standard_errors.get(name)) if name in changed else p
        for name, p in new.parameters.items()
    }
    origin = {**_origin(findings), "before": parameters.name}
    used = {name: file for name, file in files.items() if name in own}
    return replace(
        new,
        parameters=kept,
        origin=origin,
        effects={**parameters.effects, **own},
        effect_files={**parameters.effect_files, **used},
    )


def axis_parameter_set(
    findings: AxisResult, given: ParameterSet | None, files: Mapping[str, str]
) -> ParameterSet:
    """The fitted values of an axis, and the effects that the answer names beside those given.

    The sizes of an effect refer to the axis as it was fitted, which the set therefore holds.
    given : the parameter set that was diagnosed; files : of the user's own effects, by effect
    """
    final, units = findings.final, UNITS[findings.scale.rotary]
    before = {} if given is None else given.effects
    refers_to = reference_entries(findings.base, findings.scale)
    parameters = {
        name: Parameter(
            name=name,
            symbol=SYMBOLS[name],
            value=final.values[name],
            unit=unit,
            kind="estimated",
            source="diagnosis",
            standard_error=final.standard_errors.get(name),
        )
        for name, unit in units.items()
    }
    named = {one.effect: one for one in findings.answer.ranking if one.accepted}
    effects = {
        name: {
            q.name.removeprefix(f"{name}_"): q.value
            for q in one.parameters
            if q.name.startswith(f"{name}_")
        }
        | refers_to
        for name, one in named.items()
    }
    return ParameterSet(
        name="axis",
        parameters=parameters,
        origin={**_origin(findings), "model": "axis"},
        effects={**before, **effects},
        effect_files={name: file for name, file in files.items() if name in (*before, *named)},
    )


def _origin(findings: Findings) -> dict[str, object]:
    return {
        "date": today(),
        "version": program_version(),
        "logs": list(findings.answer.logs.estimation),
        "verdict": findings.answer.verdict.statement,
    }


def _of_runs(
    effect: Effect, states: Sequence[Mapping[str, float]], recordings: Sequence[Recording]
) -> dict[str, float]:
    """Means over the runs of an effect's values per run, fitted or measured."""
    own = {effect.name: effect.plausible()}
    told = [*states, *(with_logged_values(r, own).logged_values for r in recordings)]
    values = {
        key: [run[name] for run in told if (name := f"{effect.name}_{key}") in run]
        for key in effect.parameters
    }
    return {
        key: _mean(found, effect.parameters[key].unit) for key, found in values.items() if found
    }


def _mean(values: Sequence[float], unit: str) -> float:
    """Mean of values; for angles, the direction of the sum of their unit vectors [rad]."""
    if unit == "rad":
        return float(np.angle(np.mean(np.exp(1j * np.asarray(values)))))
    return float(np.mean(values))
