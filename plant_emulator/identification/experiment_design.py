"""Which run would determine what the logs at hand do not.

Each drive program is simulated at the fitted parameters; its information matrix, as sharp as the
noise of the logs allows, is added to theirs. Start states are eliminated (Schur complement), since
every run has its own.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.estimation import least_squares
from plant_emulator.estimation.covariance import data_errors
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.recording import Recording
from plant_emulator.signals.log import COMPARED, VOLTAGE, Log
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram
from plant_emulator.simulation.simulate import run_of, simulate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.identification.identify import Identification
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """The program that sharpens a parameter most, and the standard error with it [unit]."""

    parameter: str
    program: str
    standard_error: float
    enough: bool


def experiments(
    found: Identification, recordings: Sequence[Recording], values: Mapping[str, float]
) -> list[Experiment]:
    """For every parameter that is not identifiable the program that would say most about it.

    values : all parameters, at what was found [SI]
    """
    open_ones = [k for k, p in enumerate(found.parameters) if not p.identifiable]
    if not open_ones:
        return []
    count = len(found.parameters)
    known = without_states(found.estimate.information, count)
    noise = noise_levels(recordings)
    errors = {}
    for drive in PROGRAMS.values():
        if isinstance(drive, SpeedProgram):
            # A program that the model cannot be driven through at these values gives no advice.
            with suppress(UnsettledError):
                more = _information(drive, found, values, noise)
                errors[drive.name] = data_errors(known + more)
    if not errors:
        return []
    answers = []
    for k in open_ones:
        parameter = found.parameters[k]
        program = min(errors, key=lambda name: float(errors[name][k]))
        unknown = found.estimate.unknowns[k]
        error = unknown.error(parameter.value, float(errors[program][k]))
        answers.append(
            Experiment(
                parameter=parameter.name,
                program=program,
                standard_error=error,
                enough=error <= parameter.enough,
            )
        )
    return answers


def without_states(information: Array, count: int) -> Array:
    """Information on the first `count` unknowns, the others free (Schur complement)."""
    own, cross, rest = (
        information[:count, :count],
        information[:count, count:],
        information[count:, count:],
    )
    if rest.size == 0:
        return own
    return np.asarray(own - cross @ np.linalg.pinv(rest, hermitian=True) @ cross.T)


def noise_levels(recordings: Sequence[Recording]) -> dict[str, float]:
    """Noise of each channel, the mean over the logs that have it [SI]."""
    return {
        name: float(
            np.mean([r.noise[r.channels.index(name)] for r in recordings if name in r.channels])
        )
        for name in (*COMPARED, VOLTAGE)
        if any(name in r.channels for r in recordings)
    }


def _information(
    program: SpeedProgram,
    found: Identification,
    values: Mapping[str, float],
    noise: Mapping[str, float],
) -> Array:
    """Information of one more run on the parameters, its own start state free."""
    time, reference = program.reference()
    run = run_of(Log(time, {"speed_reference": reference}, program.name))

    planned = Recording(
        simulate(run, values),
        run,
        tuple(noise),
        np.array(list(noise.values())),
        np.ones((len(noise), len(time)), bool),
    )

    def residual(trial: Mapping[str, float]) -> Array:
        return planned.settled(*split_gap_position({**values, **trial}))

    residuals: list[Residual] = [residual]
    count = len(found.parameters)
    parameters = [
        replace(u, start=p.value)
        for u, p in zip(found.estimate.unknowns[:count], found.parameters, strict=True)
    ]
    states = [replace(u, run=0) for u in found.estimate.unknowns[count:] if u.run == 0]
    return without_states(
        least_squares.linearise_at([*parameters, *states], residuals).information, count
    )
