"""What the commands simulate: a program by its name, or a log by its inputs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, cast

from plant_emulator import logs
from plant_emulator.log import Log
from plant_emulator.programs import PROGRAMS, SpeedProgram, program
from plant_emulator.simulate import Hold, fit_start, run_of, simulate, values_of
from plant_emulator.travel import travel

if TYPE_CHECKING:
    from plant_emulator.parameters import ParameterSet

Effects = Mapping[str, Mapping[str, float]]


def simulated(
    name: str, parameters: ParameterSet, effects: Effects, *, hold: str | None, start: str
) -> Log:
    """The simulated log of a program, or of the inputs of the log file of that path."""
    if name not in PROGRAMS and Path(name).exists():
        return followed(logs.read(name), parameters, effects, hold, start)
    known = program(name)
    if not isinstance(known, SpeedProgram):
        return travel(known, parameters, effects)
    time, reference = known.reference()
    inputs = Log(time, {"speed_reference": reference}, name)
    return simulate(run_of(inputs, cast("Hold | None", hold)), values_of(parameters, effects))


def followed(
    log: Log, parameters: ParameterSet, effects: Effects, hold: str | None, start: str
) -> Log:
    """The simulation of a log from its reference and truck torque.

    hold, start : as the options --reference and --start
    """
    run, values = run_of(log, cast("Hold | None", hold)), values_of(parameters, effects)
    position = fit_start(log, run, values) if start == "fit" else 0.0
    return simulate(run, values, gap_position=position)
