"""From log files to a diagnosis: reading, preflight, which runs are held out, saving."""

from __future__ import annotations

import csv
import hashlib
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator import effects
from plant_emulator.diagnosis.calibration.confidence import Case
from plant_emulator.diagnosis.calibration.model_form_error import Sized, law_errors
from plant_emulator.diagnosis.machines.axis import AxisRecipe
from plant_emulator.diagnosis.machines.axis_effects import EFFECTS as AXIS_EFFECTS
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.diagnosis.prediction.held_out import Plan
from plant_emulator.errors import DiagnosisError
from plant_emulator.estimation.initial_states import with_own
from plant_emulator.recordings.preflight import LEAST_MOTION
from plant_emulator.solver.kernel import kernel
from plant_emulator.workflows import axis_reader
from plant_emulator.workflows.loading import admitted, distinct, unlabelled

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.diagnose import Findings
    from plant_emulator.diagnosis.execution.pool import Recipe
    from plant_emulator.effects import Effect
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Log

# Of a single log this share is fitted, and the rest predicted.
FITTED_SHARE = 0.6


@dataclass(frozen=True, kw_only=True)
class Loaded:
    """Logs ready for a diagnosis, and what the preflight told of them.

    fitted : those of the bench that are not held out
    """

    recipe: Recipe
    plan: Plan
    notes: tuple[str, ...]
    settings: Mapping[str, str]
    fitted: tuple[Recording, ...] = ()


def loaded(
    paths: Sequence[str],
    held_out: Sequence[str],
    parameters: ParameterSet,
    *,
    without: Sequence[str] = (),
    own: Sequence[str] = (),
    hold: str | None = None,
) -> Loaded:
    """The logs as a recipe and a plan; an InputError says what cannot be used."""
    files = tuple(Path(file).absolute() for file in own)
    named = [effect.name for effect in effects.from_files(files)]
    _known(without, [*effects.names(), *named])
    recordings, notes = admitted([*paths, *held_out], parameters, hold)
    recordings, plan = planned(recordings, len(paths))
    settings = _settings(
        {
            "parameters": parameters.name,
            "without": ", ".join(without) or "-",
            "own effects": ", ".join(own) or "-",
        },
        _digests([*paths, *held_out, parameters.name, *own]),
    )
    recipe = BenchRecipe(tuple(recordings), parameters, tuple(without), files)
    return Loaded(
        recipe=recipe,
        plan=plan,
        notes=tuple(notes),
        settings=settings,
        fitted=tuple(recordings[k] for k in plan.fitted),
    )


def calibration() -> list[Case]:
    """The cases of the blind trial that this version was calibrated with."""
    with (Path(__file__).parents[1] / "diagnosis" / "calibration" / "calibration.csv").open(
        newline=""
    ) as file:
        return [
            Case(kind=row["kind"], evidence=float(row["evidence"]), right=row["right"] == "True")
            for row in csv.DictReader(file)
        ]


def laws_apart() -> dict[str, float]:
    """Standard errors that other laws make in the sizes of effects, relative, by name; see
    `law_error`.
    """
    with (Path(__file__).parents[1] / "diagnosis" / "calibration" / "law_errors.csv").open(
        newline=""
    ) as file:
        numbers = ("true", "estimated", "standard_error")
        return law_errors(
            [
                Sized(
                    name=f"{row['effect']}_{row['parameter']}",
                    plausible=_plausible(row["effect"], row["parameter"]),
                    **{key: float(row[key]) for key in numbers},
                )
                for row in csv.DictReader(file)
            ]
        )


def _plausible(effect: str, parameter: str) -> float:
    """Size of an effect of the library that is usual, from neutral [its unit]."""
    declared = effects.load(effect).parameters[parameter]
    return abs(declared.plausible - declared.neutral)


def axis_loaded(
    paths: Sequence[str], held_out: Sequence[str], *, without: Sequence[str] = ()
) -> Loaded:
    """Logs of a single axis as a recipe and a plan."""
    axis_logs = [axis_reader.read(path) for path in (*paths, *held_out)]
    for log in axis_logs:
        unlabelled(log)
    distinct([(log.source, np.stack([log.time, log.position, log.force])) for log in axis_logs])
    if len(axis_logs) < 2:
        raise DiagnosisError(
            f"{paths[0]}: one run of an axis cannot be held out; give another with --hold-out"
        )
    _known(without, AXIS_EFFECTS)
    plan = plan_of(len(axis_logs), len(paths))
    digests = _digests([*paths, *held_out])
    settings = _settings({"model": "axis", "without": ", ".join(without) or "-"}, digests)
    recipe = AxisRecipe(tuple(axis_logs), fitted=plan.fitted, without=tuple(without))
    return Loaded(recipe=recipe, plan=plan, notes=(), settings=settings)


def plan_of(runs: int, count: int) -> Plan:
    """Held-out runs are predicted; without such each of several runs in turn."""
    fitted = tuple(range(count))
    if runs > count:
        return Plan(fitted=fitted, folds=((fitted, tuple(range(count, runs))),))
    turns = tuple((tuple(k for k in fitted if k != run), (run,)) for run in fitted)
    return Plan(fitted=fitted, folds=turns)


def planned(recordings: Sequence[Recording], count: int) -> tuple[list[Recording], Plan]:
    """Which runs are fitted and which predicted; the first `count` are to be fitted.

    With held-out runs those are predicted; of several logs each in turn; a single log is fitted on
    its first part and predicted on the rest.
    """
    if len(recordings) > 1:
        return list(recordings), plan_of(len(recordings), count)
    (whole,) = recordings
    end = whole.log.time[0] + FITTED_SHARE * float(np.ptp(whole.log.time))
    first = whole.log.time <= end
    _both_move(whole.log, first)
    both = [replace(whole, use=whole.use & part) for part in (first, ~first)]
    return both, Plan(fitted=(0,), folds=(((0,), (1,)),), as_fitted=True)


def _both_move(log: Log, first: NDArray[np.bool_]) -> None:
    """Refuse a single log of which a part shows no motion: fitted or judged by noise."""
    for which, part, share in (("first", first, FITTED_SHARE), ("last", ~first, 1 - FITTED_SHARE)):
        span = float(np.ptp(log["motor_speed"][part]))
        if span < LEAST_MOTION:
            raise DiagnosisError(
                f"{log.source}: no held-out run is possible: in the {which} {100 * share:.0f} % "
                f"of it motor_speed_rad_s moves by {span:.1f} rad/s only, {LEAST_MOTION:g} or more "
                "are needed; give another run beside it, or with --hold-out"
            )


def _known(without: Sequence[str], library: Collection[str]) -> None:
    """Refuse to take out what is not there: a misspelt name would leave its effect in."""
    for name in without:
        if name not in library:
            known = ", ".join(sorted(library))
            raise DiagnosisError(f"--without {name}: no effect of that name; known: {known}")


def _settings(own: Mapping[str, str], hashes: Mapping[str, str]) -> dict[str, str]:
    """What a report tells to repeat a diagnosis."""
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "version": version("road-load-bench"),
        **own,
        **{f"sha256 of {path}": digest for path, digest in hashes.items()},
    }


def _digests(paths: Sequence[str]) -> dict[str, str]:
    """SHA-256 of every one of these that is a file."""
    files = [path for path in paths if Path(path).is_file()]
    return {path: hashlib.sha256(Path(path).read_bytes()).hexdigest() for path in files}


def parameter_set(
    findings: Findings, parameters: ParameterSet, recordings: Sequence[Recording]
) -> ParameterSet:
    """The set with the accepted effects in it; values of single runs as their mean.

    recordings : the runs that were fitted
    """
    final, named = findings.final, findings.answer.verdict.effects
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
    origin = {
        "date": datetime.now(UTC).date().isoformat(),
        "version": version("road-load-bench"),
        "before": parameters.name,
        "logs": list(findings.answer.logs.estimation),
        "verdict": findings.answer.verdict.statement,
    }
    return replace(new, parameters=kept, origin=origin, effects={**parameters.effects, **own})


def _of_runs(
    effect: Effect, states: Sequence[Mapping[str, float]], recordings: Sequence[Recording]
) -> dict[str, float]:
    """What is each run's own of an effect, fitted or told by the log, as the mean of the runs."""
    own = {effect.name: effect.plausible()}
    told = [*states, *(with_own(r, own).own for r in recordings)]
    values = {
        key: [run[name] for run in told if (name := f"{effect.name}_{key}") in run]
        for key in effect.parameters
    }
    return {
        key: _mean(found, effect.parameters[key].unit) for key, found in values.items() if found
    }


def _mean(values: Sequence[float], unit: str) -> float:
    """Mean of values; of angles the direction of the sum of their unit vectors [rad]."""
    if unit == "rad":
        return float(np.angle(np.mean(np.exp(1j * np.asarray(values)))))
    return float(np.mean(values))
