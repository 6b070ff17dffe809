"""What the commands simulate: a program by its name, or a log by its inputs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, cast

from plant_emulator import logs
from plant_emulator.estimation.initial_states import fit_states, states_of, with_own
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log, without_voltage
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram, program
from plant_emulator.simulation.simulate import Hold, fit_start, run_of, simulate, values_of
from plant_emulator.simulation.travel_program import travel
from plant_emulator.solver.kernel import kernel

if TYPE_CHECKING:
    from plant_emulator.model.parameters import ParameterSet

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

    What the effects of the set start from is each run's own, as its position in the gap; of an
    effect that is asked for, in `effects`, every value stays as it was given.

    hold, start : as the options --reference and --start
    """
    values = values_of(parameters, effects)
    left = {name: own for name, own in parameters.effects.items() if name not in effects}
    known = kernel().effects if left else {}
    if start == "fit" and any(p.per_run for name in left for p in known[name].parameters.values()):
        measured = with_own(recording(without_voltage(log), cast("Hold | None", hold)), left)
        states = fit_states(measured, values, states_of(left))
        own, gap = split_gap_position({**values, **measured.own, **states})
        return simulate(measured.run, own, gap_position=gap)
    run = run_of(log, cast("Hold | None", hold))
    position = fit_start(log, run, values) if start == "fit" else 0.0
    return simulate(run, values, gap_position=position)
