"""The next experiment of a diagnosis as a drive program that `gateway drive` takes."""

from __future__ import annotations

import re
from pathlib import Path

from plant_emulator.errors import ParameterError
from plant_emulator.simulation.programs import PROGRAMS, SAMPLE_PERIOD, SpeedProgram, describe


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
    text = "\n".join(("time_s,speed_reference_rad_s", *rows))
    Path(path).write_text(text + "\n", encoding="utf-8")
    return describe(program)
