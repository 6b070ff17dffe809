"""Simulates the logs of a case with small fixed steps, and adds noise, quantisation and dirt."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.blind.dirt import soil, take_rows
from plant_emulator.errors import UnsettledError
from plant_emulator.signals.log import Log
from plant_emulator.simulation.programs import SpeedProgram, program
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.simulation.travel_program import simulate_travel

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.blind.case import Case
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.simulation.run_inputs import RunInputs

# [s] A fiftieth of a sample. The diagnosis uses adaptive steps of up to a whole sample. The step is
# halved at most HALVINGS times if the solver does not converge.
TRUTH_STEP, HALVINGS = 2e-4, 3
# Rows of a finer log between two rows. Between rows 10 ms apart, a line cuts off a contact by up to
# 14 times the noise; a log whose rows are taken early or late needs closer ones.
FINER = 10
# The bench of the thesis does not log the armature voltage.
NOT_LOGGED = "armature_voltage"


def simulate_truth(case: Case, parameters: ParameterSet) -> list[Log]:
    """Simulate the noise-free log of every run.

    parameters : the nominal set
    Raises UnsettledError if the solver does not converge with the smallest step.
    """
    return [_simulate_run(case, run, parameters) for run in range(len(case.programs))]


def _simulate_run(case: Case, run: int, parameters: ParameterSet, finer: int = 1) -> Log:
    """Simulate a run; finer : rows of the log for each row of its program, 1 with a truck."""
    bench = parameters.with_values(case.parameters)
    effects = {hidden.law: hidden.in_run(run) for hidden in case.hidden}
    found = program(case.programs[run])
    if isinstance(found, SpeedProgram):
        rows, reference = found.reference()
        number = np.arange(finer * (len(rows) - 1) + 1) / finer
        time = np.interp(number, np.arange(len(rows)), rows)
        asked = np.interp(time, rows, reference)
        inputs = inputs_of(Log(time, {"speed_reference": asked}, found.name))
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


def measure(case: Case, log: Log, run: int, parameters: ParameterSet) -> Log:
    """Add sensor noise, quantisation and the case's dirt to the noise-free log of one run.

    parameters : the nominal set
    """
    seed = case.noise + run
    if case.dirt is None:
        return add_noise(log, seed)
    if case.dirt.kind != "jitter":
        return soil(add_noise(log, seed), case.dirt, seed)
    fine = log
    if isinstance(program(case.programs[run]), SpeedProgram):
        fine = _simulate_run(case, run, parameters, FINER)
    return add_noise(take_rows(fine, log.time, case.dirt.size, seed), seed)
