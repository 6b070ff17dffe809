"""A drive program on the live bench: a recording, and at once a log of the run."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.commissioning.drive import Point, configure_program, program_of
from gateway.configuration.config import Config
from gateway.configuration.program import Program
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.recordings import log_writer, program_file, recording
from gateway.recordings.export import Export, Extent, of_recording, unwrap_time
from gateway.recordings.header import map_of
from gateway.workflows.live_program import Ended, run_program
from register_maps.logs.drive_programs import DRIVE_PROGRAMS
from register_maps.timing import SCAN

REST_AFTER: Final = 1.0
"""[s] Rest before the run that the log shows: the bench has to stand at its first sample."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A program that was driven: how it ended, and its log, None: the run did not begin."""

    program: Program
    ended: Ended
    log: Path | None
    samples: int

    def to_json(self) -> dict[str, Any]:
        """Return the drive as the document drive/1."""
        return {
            "schema": "drive/1",
            "program": self.program.name,
            "duration_s": self.program.duration,
            "completed": self.ended.completed,
            "stop_reason": self.ended.why,
            "recording": str(self.ended.recording),
            "log": None if self.log is None else str(self.log),
            "samples": self.samples,
        }


def read_program(program: str | Path, repeats: int = 1) -> Program:
    """The drive program of that name, or in that file. Raises ConfigError."""
    known = DRIVE_PROGRAMS.get(str(program))
    if known is not None:
        points = [Point(time=time, speed=speed) for time, speed in known.points(SCAN)]
        return program_of(known.name, points, repeats)
    if not Path(program).exists():
        raise ConfigError(
            "neither a drive program nor a file",
            place=str(program),
            expected=f"a CSV file, or one of {', '.join(DRIVE_PROGRAMS)}",
        )
    return program_of(str(program), program_file.read(Path(program)), repeats)


def drive(
    program: Program, config: Config, *, view: bool = True, report: Callable[[str], None]
) -> Drive:
    """Drive a program on the live bench; write its recording and its log.

    view : show the run on standard output; report : takes lines for the operator

    Raises ConfigError, before anything turns, where the limits would clip the program.
    """
    prepared = configure_program(config, program)
    report(
        f"no truck on the drum; {program.name} takes {program.duration:.0f} s from the moment in "
        "which the PLC is switched to remote"
    )
    ended = run_program(prepared, view=view)
    log = ended.recording.with_suffix(".csv.gz")
    samples = write_log(ended.recording, log)
    return Drive(program=program, ended=ended, log=log if samples else None, samples=samples)


def write_log(path: Path, target: Path) -> int:
    """Write the log of a run, from a moment of rest before it; return the count of its samples.

    Nothing is written of a run that did not begin: 0 samples.
    """
    start = _start(path)
    if start is None:
        return 0
    export = Export(recording.stream(path), Extent(begin=start - REST_AFTER))
    log_writer.write(target, export)
    return export.survey.samples


def _start(path: Path) -> float | None:
    """Time of the log at which the run of a recording begins [s]; None: it did not begin."""
    found = recording.read(path)
    rows = found.records[of_recording(found)]
    time = unwrap_time(rows["measured_plc_time"], map_of(found.header).modulus("plc_time"))
    running = np.flatnonzero(rows["state"] == State.RUN)
    return float(time[running[0]]) if len(running) else None
