"""Which runs files give: whole files, parts in time as `FILE@12.5:20`, or many files as one run.

A part of a log that is held out is taken out of the log that is fitted. Where a log has a hole, and
where one file of a run ends, nothing is known of the motion: no sample is compared over it, and
what lies on either side is evaluated by itself.
"""

from __future__ import annotations

import re
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows import axis_reader
from plant_emulator.workflows.diagnosis.plan import FITTED_SHARE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    # A log, or the path of its file, with a part in time or without.
    Source = str | Path | AxisLog

NUMBER = r"[-+]?[0-9]*\.?[0-9]*(?:[eE][-+]?[0-9]+)?"
PART = re.compile(rf"(?P<file>.+)@(?P<start>{NUMBER}):(?P<end>{NUMBER})")
# A step between samples that is so much longer than the usual one is a hole.
PART_HOLE = 20.0
# A rest of a log with fewer samples is no run.
FEWEST_SAMPLES = 100

QUANTITIES = ("time", "position", "force", "velocity", "load", "temperature")

Part = tuple[float, float]


def file_of(source: str | Path) -> Path:
    """Path of a source without its part in time."""
    found = PART.fullmatch(str(source))
    whole = found is None or Path(source).is_file()
    return Path(source) if whole or found is None else Path(found["file"])


def read_runs(
    logs: Sequence[Source],
    held_out: Sequence[Source],
    columns: Sequence[str] | Mapping[str, str] = (),
    *,
    one_run: bool = False,
) -> tuple[list[AxisLog], list[AxisLog]]:
    """The runs to fit, and those to predict; none to predict: each of several runs in turn.

    columns : choice of columns, for every file; one_run : the files of `logs` are one run
    A single run is fitted on its first part and predicted on the rest.
    Raises LogError for a file that cannot be used.
    """
    paths = {file_of(one) for one in (*logs, *held_out) if not isinstance(one, AxisLog)}
    files = {path: axis_reader.read(path, columns) for path in sorted(paths)}
    predicted = [part for one in held_out for part in without_holes(_run(one, files))]
    left = [run for one in logs for run in _without_held_out(one, files, held_out)]
    fitted = [part for run in left for part in without_holes(run)]
    if predicted or not (one_run or len(fitted) == 1):
        return fitted, predicted
    return _in_time(fitted)


def _in_time(logs: Sequence[AxisLog]) -> tuple[list[AxisLog], list[AxisLog]]:
    """The first part of a run in one or several files, and its rest, by the time that they take."""
    left = FITTED_SHARE * sum(float(np.ptp(log.time)) for log in logs)
    first, rest = [], []
    for log in logs:
        end = float(log.time[0]) + left
        left -= float(np.ptp(log.time))
        first += [part] if (part := _samples(log, (-inf, end))) else []
        rest += [part] if (part := _samples(log, (end, inf))) else []
    if not first or not rest:
        raise LogError(
            f"{logs[0].source}: too short to be fitted on its first part and predicted on the "
            f"rest; {FEWEST_SAMPLES} samples are needed in either, or another log"
        )
    return first, rest


def _part(source: str | Path) -> Part | None:
    """Start and end of the part of its file that a source is [s]; None: the whole file."""
    found = PART.fullmatch(str(source))
    if found is None or Path(source).is_file():
        return None
    try:
        part = (float(found["start"] or -inf), float(found["end"] or inf))
    except ValueError as error:
        raise LogError(f"{source}: FILE@START:END is expected, both in s") from error
    if part[0] >= part[1]:
        raise LogError(f"{source}: the end is not after the start")
    return part


def _run(source: Source, files: Mapping[Path, AxisLog]) -> AxisLog:
    """The run of a source, or the part of it."""
    if isinstance(source, AxisLog):
        return source
    log, part = files[file_of(source)], _part(source)
    return log if part is None else cut(log, part)


def _without_held_out(
    source: Source, files: Mapping[Path, AxisLog], held_out: Sequence[Source]
) -> list[AxisLog]:
    """The part of a source that is fitted: its file without the parts that are held out."""
    run = _run(source, files)
    if isinstance(source, AxisLog):
        return [run]
    taken = sorted(
        part
        for one in held_out
        if not isinstance(one, AxisLog) and file_of(one) == file_of(source) and (part := _part(one))
    )
    if not taken:
        return [run]
    starts, ends = (-inf, *(end for _, end in taken)), (*(start for start, _ in taken), inf)
    spans = zip(starts, ends, strict=True)
    parts = [part for part in (_samples(run, span) for span in spans) if part is not None]
    if not parts:
        raise LogError(f"{source}: all of it is held out; another log to fit is needed")
    return parts


def cut(log: AxisLog, part: Part) -> AxisLog:
    """The samples of a log from the start of a part on [s], before its end.

    Raises LogError where fewer than two samples lie in the part.
    """
    kept = (log.time >= part[0]) & (log.time < part[1])
    if kept.all():
        return log
    before = PART.fullmatch(log.source)
    file = before["file"] if before else log.source
    start, end = ("" if abs(edge) == inf else f"{edge:.6g}" for edge in part)
    if before:
        start, end = start or before["start"], end or before["end"]
    source = f"{file}@{start}:{end}" if start or end else file
    if kept.sum() < 2:
        raise LogError(
            f"{source}: {kept.sum()} samples; a part between {log.time[0]:g} and "
            f"{log.time[-1]:g} s is needed"
        )
    held = [name for name in QUANTITIES if getattr(log, name) is not None]
    found: dict[str, Any] = {name: getattr(log, name)[kept] for name in held}
    return replace(log, **found, source=source)


def without_holes(log: AxisLog) -> list[AxisLog]:
    """The parts of a log between its holes; LogError where none is long enough."""
    steps = np.diff(log.time)
    edges = log.time[1:][steps > PART_HOLE * np.median(steps)].tolist()
    if not edges:
        return [log]
    spans = zip((-inf, *edges), (*edges, inf), strict=True)
    parts = [part for part in (_samples(log, span) for span in spans) if part is not None]
    if not parts:
        raise LogError(
            f"{log.source}: holes in time leave no part of {FEWEST_SAMPLES} samples; a hole "
            f"is a step of more than {PART_HOLE:g} times the usual one"
        )
    return parts


def _samples(log: AxisLog, part: Part) -> AxisLog | None:
    """The part of a log if it is long enough to be a run."""
    inside = (log.time >= part[0]) & (log.time < part[1])
    return cut(log, part) if inside.sum() >= FEWEST_SAMPLES else None
