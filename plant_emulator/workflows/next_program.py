"""The next experiment of a diagnosis as a file that `gateway drive` and `simulate` take."""

from __future__ import annotations

import re
from pathlib import Path

from plant_emulator.errors import LogError, ParameterError
from plant_emulator.simulation.programs import PROGRAMS, SAMPLE_PERIOD, SpeedProgram, describe
from register_maps.logs.csv_log import TIME, parse
from register_maps.logs.log_table import LogTableError
from register_maps.signals import LOG_COLUMNS

SPEED = "speed_reference_rad_s"
HEADER = f"{TIME},{SPEED}"


def write_next_program(
    next_experiment: str | None, path: str | Path, own: SpeedProgram | None = None
) -> str:
    """Write the drive program that a next experiment names; return what was written, in words.

    own : the program of the experiment, where it is none of the shipped ones
    Raises ParameterError where the experiment names no program that a bench can drive by itself.
    """
    advised = next_experiment or "nothing is left to decide"
    named = [p for p in PROGRAMS.values() if re.search(rf"\b{p.name}\b", advised)]
    programs = [p for p in (own, *named) if isinstance(p, SpeedProgram)]
    if not programs:
        why = "it needs a truck on the drum" if named else "it names no drive program"
        raise ParameterError(f"no next program, {why}: {advised}")
    program = programs[0]
    rows = (f"{time:g},{speed:.6g}" for time, speed in program.points(SAMPLE_PERIOD))
    text = "\n".join((HEADER, *rows))
    Path(path).write_text(text + "\n", encoding="utf-8")
    return describe(program)


def read_drive_program(path: str | Path) -> SpeedProgram | None:
    """The drive program in a file with times and references alone; None: it is another file.

    Raises LogError with line and column for a value that is no program's.
    """
    path = Path(path)
    if not path.is_file():
        return None
    with path.open("rb") as file:
        if file.readline().strip() != HEADER.encode():
            return None
    try:
        found = parse(
            path.read_bytes(), {name: LOG_COLUMNS[name] for name in (TIME, SPEED)}
        ).signals
    except LogTableError as error:
        raise LogError(f"{path}: {error}") from error
    times = [time - found["time"][0] for time in found["time"]]
    corners = tuple(zip(times, found["speed_reference"], strict=True))
    return SpeedProgram(name=path.stem, duration=times[-1], corners=corners, sweeps=())
