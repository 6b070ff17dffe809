"""From a case to its logs, by fixed fine steps, with the sensors' noise and quantisation."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from plant_emulator.errors import UnsettledError
from plant_emulator.signals.log import Log
from plant_emulator.simulation.programs import SpeedProgram, program
from plant_emulator.simulation.sensor_noise import noisy
from plant_emulator.simulation.simulate import run_of, simulate, values_of
from plant_emulator.simulation.travel_program import travel

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.blind.case import Case
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.simulation.simulate import Run

# A fiftieth of a sample [s]; the diagnosis simulates with adapted steps up to a whole one. Halved
# so many times at most where a stage of the truth does not settle.
STEP, HALVED = 2e-4, 3
# The bench of the thesis does not log it.
NOT_LOGGED = "armature_voltage"


def true_logs(case: Case, parameters: ParameterSet) -> list[Log]:
    """The noise-free log of every run; parameters : the nominal set."""
    return [_true_log(case, run, parameters) for run in range(len(case.programs))]


def _true_log(case: Case, run: int, parameters: ParameterSet) -> Log:
    bench = parameters.with_values(case.parameters)
    effects = {hidden.law: hidden.in_run(run) for hidden in case.hidden}
    known = program(case.programs[run])
    if isinstance(known, SpeedProgram):
        time, reference = known.reference()
        inputs = run_of(Log(time, {"speed_reference": reference}, known.name))
        log = _settled(inputs, values_of(bench, effects), case.gaps[run])
    else:
        log = travel(known, bench, effects, gap_position=case.gaps[run])
    signals = {name: signal for name, signal in log.signals.items() if name != NOT_LOGGED}
    return Log(log.time, signals, known.name)


def _settled(inputs: Run, values: Mapping[str, float], gap_position: float) -> Log:
    """The simulation by the largest step that settles; UnsettledError where none does."""
    for halved in range(HALVED):
        with suppress(UnsettledError):
            return simulate(inputs, values, gap_position=gap_position, step=STEP / 2**halved)
    return simulate(inputs, values, gap_position=gap_position, step=STEP / 2**HALVED)


def measured(case: Case, log: Log, run: int) -> Log:
    """The log as the sensors show it."""
    return noisy(log, case.noise + run)
