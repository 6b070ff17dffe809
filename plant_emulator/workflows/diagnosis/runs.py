"""From logs to the runs of a diagnosis: reading, preflight, and which runs are held out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from plant_emulator import effects
from plant_emulator.diagnosis.axis.diagnose import AxisRuns
from plant_emulator.diagnosis.axis.effects import NAMES as AXIS_EFFECTS
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.diagnosis.report.details import EstimatedInput
from plant_emulator.errors import DiagnosisError
from plant_emulator.estimation.free_parameters import free_parameters
from plant_emulator.recordings.axis_preflight import axis_notes
from plant_emulator.recordings.wheel_torque import deviation
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.signals.log import WHEEL_TORQUE, Log
from plant_emulator.workflows.axis_files.own_effects import own_effects
from plant_emulator.workflows.diagnosis.axis_parts import file_of, read_runs
from plant_emulator.workflows.diagnosis.axis_set import known_axis
from plant_emulator.workflows.diagnosis.plan import plan_of_runs, plan_recordings
from plant_emulator.workflows.loading import (
    check_distinct,
    check_unlabelled,
    load_recordings,
)
from plant_emulator.workflows.provenance import file_hash, program_version, today
from register_maps.logs.poll_quality import PollQuality

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from plant_emulator.diagnosis.prediction.held_out import Plan
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

    # A log, or the path of its file.
    Source = str | Path | Log | AxisLog


RecipeT = TypeVar("RecipeT")


@dataclass(frozen=True, kw_only=True)
class Runs(Generic[RecipeT]):
    """The runs of a diagnosis.

    notes : what the preflight noticed about the logs
    settings : what a report shows to repeat the diagnosis, by name
    fitted : recordings of the bench that are not held out; empty for another machine
    inputs : of the runs that nobody measured
    """

    recipe: RecipeT
    plan: Plan
    notes: tuple[str, ...]
    settings: Mapping[str, str]
    fitted: tuple[Recording, ...] = ()
    inputs: tuple[EstimatedInput, ...] = ()


def bench_runs(
    logs: Sequence[Source],
    held_out: Sequence[Source],
    parameters: ParameterSet,
    *,
    without: Sequence[str] = (),
    effect_files: Sequence[str | Path] = (),
    reference: str | None = None,
) -> Runs[BenchRecipe]:
    """The runs of logs of the bench.

    without : effects that are taken out of the library; effect_files : files of effects beside it
    reference : what holds between samples of the reference; None: as the log says
    Raises InputError for a log that cannot be used.
    """
    given = [Path(file).absolute() for file in effect_files]
    stems = {file.stem for file in given}
    of_set = [Path(file).absolute() for file in parameters.effect_files.values()]
    files = (*given, *(file for file in of_set if file.stem not in stems))
    named = [effect.name for effect in effects.from_files(files)]
    _check_names(without, [*effects.names(), *named])
    recordings, notes = load_recordings(
        [bench_source(one) for one in (*logs, *held_out)],
        parameters,
        reference,
        common_channels=True,
        fitted=len(logs),
    )
    recordings, plan = plan_recordings(recordings, len(logs))
    settings = {
        "parameters": parameters.name,
        "without": ", ".join(without) or "-",
        "own effects": ", ".join(map(str, effect_files)) or "-",
        **{f"sampling of {r.log.source}": describe_sampling(r.log.time) for r in recordings},
    }
    fitted = tuple(recordings[k] for k in plan.fitted)
    free = free_parameters(parameters, recordings=fitted)
    return Runs(
        recipe=BenchRecipe(tuple(recordings), parameters, tuple(without), files, free),
        plan=plan,
        notes=tuple(notes),
        settings=_settings(settings, [*logs, *held_out, parameters.name, *effect_files]),
        inputs=_estimated_torques(recordings, parameters),
        fitted=fitted,
    )


def axis_runs(
    logs: Sequence[Source],
    held_out: Sequence[Source],
    *,
    without: Sequence[str] = (),
    effect_files: Sequence[str | Path] = (),
    columns: Sequence[str] | Mapping[str, str] = (),
    one_run: bool = False,
    parameters: ParameterSet | None = None,
) -> Runs[AxisRuns]:
    """The runs of logs of a single axis; arguments and errors as those of `bench_runs`.

    columns : NAME=COLUMN[*FACTOR][:UNIT] for columns of files without an accepted name
    one_run : the files of `logs` are one run
    """
    own = own_effects(effect_files)
    known = None if parameters is None else known_axis(parameters)
    _check_names(without, [*AXIS_EFFECTS, *(effect.name for effect in own)])
    sources = [_axis_source(one) for one in (*logs, *held_out)]
    fitted, predicted = read_runs(
        sources[: len(logs)], sources[len(logs) :], columns, one_run=one_run
    )
    runs = [*fitted, *predicted]
    for log in runs:
        check_unlabelled(log)
    check_distinct([(log.source, np.stack([log.time, log.position, log.force])) for log in runs])
    plan = plan_of_runs(len(runs), len(fitted))
    words = columns if not isinstance(columns, Mapping) else map("=".join, columns.items())
    settings = {
        "model": "axis",
        "parameters": parameters.name if parameters else "-",
        "columns": ", ".join(words) or "-",
        "files": "parts of one run" if one_run else "a run each",
        "without": ", ".join(without) or "-",
        "own effects": ", ".join(map(str, effect_files)) or "-",
    }
    files = dict.fromkeys(file_of(one) for one in sources if not isinstance(one, AxisLog))
    return Runs(
        recipe=AxisRuns(tuple(runs), tuple(without), own, known),
        plan=plan,
        notes=tuple(axis_notes(runs)),
        settings=_settings(
            settings, [*files, *([parameters.name] if parameters else []), *effect_files]
        ),
    )


def _estimated_torques(
    recordings: Sequence[Recording], parameters: ParameterSet
) -> tuple[EstimatedInput, ...]:
    """Wheel torques that were estimated, one a log."""
    logs = {r.log.source: r.log for r in recordings if r.estimated_torque}
    return tuple(
        EstimatedInput(
            source=source,
            name="wheel torque",
            unit="N m",
            time=log.time,
            value=log[WHEEL_TORQUE],
            deviation=deviation(log, parameters),
        )
        for source, log in logs.items()
    )


def describe_sampling(time: Array) -> str:
    """The regularity of a log's sampling in words; time : of its rows [s], shape (n,)."""
    steps = np.diff(time)
    quality = PollQuality(interval=float(np.median(steps)))
    quality.count(steps.tolist())
    found = quality.entries()
    return f"every {found['periods']}; {found['skipped samples']} samples skipped"


def bench_source(source: Source) -> str | Path | Log:
    """A source of a log of the bench; DiagnosisError for a log of an axis."""
    if isinstance(source, AxisLog):
        raise DiagnosisError(f"{source.source}: a log of a single axis needs the model axis")
    return source


def _axis_source(source: Source) -> str | Path | AxisLog:
    if isinstance(source, Log):
        raise DiagnosisError(f"{source.source}: a log of the bench needs the model bench")
    return source


def _check_names(without: Sequence[str], library: Collection[str]) -> None:
    """Refuse to take out an effect that is not there: a misspelt name would leave it in."""
    for name in without:
        if name not in library:
            known = ", ".join(sorted(library))
            raise DiagnosisError(
                f"{name}: no effect of that name; known: {known}", argument="without"
            )


def _settings(own: Mapping[str, str], sources: Sequence[object]) -> dict[str, str]:
    """Date, version, these settings, and the SHA-256 of every source that is a file."""
    files = [str(one) for one in sources if isinstance(one, str | Path) and Path(one).is_file()]
    hashes = {file: file_hash(file) for file in files}
    return {
        "date": today(),
        "version": program_version(),
        **own,
        **{f"sha256 of {file}": digest for file, digest in hashes.items()},
    }
