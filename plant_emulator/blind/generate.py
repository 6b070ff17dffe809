"""Simulates the logs of a case with small fixed steps, and adds noise, quantisation and dirt."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from plant_emulator.blind.dirt import soil
from plant_emulator.errors import UnsettledError
from plant_emulator.signals.log import Log
from plant_emulator.simulation.programs import SpeedProgram, program
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import inputs_of, simulate, values_of
from plant_emulator.simulation.travel_program import simulate_travel

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.blind.case import Case
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.simulation.simulate import RunInputs

# [s] A fiftieth of a sample. The diagnosis uses adaptive steps of up to a whole sample. The step is
# halved at most HALVINGS times if the solver does not converge.
TRUTH_STEP, HALVINGS = 2e-4, 3
# The bench of the thesis does not log the armature voltage.
NOT_LOGGED = "armature_voltage"


def simulate_truth(case: Case, parameters: ParameterSet) -> list[Log]:
    """Simulate the noise-free log of every run.

    parameters : the nominal set
    Raises UnsettledError if the solver does not converge with the smallest step.
    """
    return [_simulate_run(case, run, parameters) for run in range(len(case.programs))]


def _simulate_run(case: Case, run: int, parameters: ParameterSet) -> Log:
    bench = parameters.with_values(case.parameters)
    effects = {hidden.law: hidden.in_run(run) for hidden in case.hidden}
    found = program(case.programs[run])
    if isinstance(found, SpeedProgram):
        time, reference = found.reference()
        inputs = inputs_of(Log(time, {"speed_reference": reference}, found.name))
        log = _simulate_converged(inputs, values_of(bench, effects), case.gaps[run])
    else:
        log = simulate_travel(found, bench, effects, gap_position=case.gaps[run])
    signals = {name: signal for name, signal in log.signals.items() if name != NOT_LOGGED}
    return Log(log.time, signals, found.name)


def _simulate_converged(inputs: RunInputs, values: Mapping[str, float], gap_position: float) -> Log:
    """Simulate with the largest step with which the solver converges."""
    for halvings in range(HALVINGS):
        with suppress(UnsettledError):
            return simulate(
                inputs, values, gap_position=gap_position, step=TRUTH_STEP / 2**halvings
            )
    return simulate(inputs, values, gap_position=gap_position, step=TRUTH_STEP / 2**HALVINGS)


def measure(case: Case, log: Log, run: int) -> Log:
    """Add sensor noise, quantisation and the case's dirt to the noise-free log of one run."""
    measured = add_noise(log, case.noise + run)
    return measured if case.dirt is None else soil(measured, case.dirt, case.noise + run)
