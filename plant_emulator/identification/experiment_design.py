"""Experiment design: the run that would determine what the logs at hand leave open.

Each drive program is simulated as one more run, with the noise of the logs. Its information matrix
J' J, the initial states of the run eliminated, adds to the one of the logs; the inverse of the sum
promises the standard errors of a fit to all of them.

The slopes J are taken at the values found and at several start positions in the backlash gap: where
in it a run will start is not known, and contact that comes earlier, later or elsewhere changes the
slopes. The median of the standard errors is promised. The parameters stay as found. A draw from
their covariance lies off the curved ridge that the logs allow, and promised a friction up to four
times too well.

The program is recorded with the same channels as the logs; a channel that they lack promises
nothing.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.estimation.covariance import data_errors
from plant_emulator.estimation.least_squares import linearise_at
from plant_emulator.estimation.nearby import Changed
from plant_emulator.estimation.noise.channel_noise import ChannelNoise, Whitener
from plant_emulator.estimation.residuals import SimulatedRun
from plant_emulator.identification.identify import FINAL_TOLERANCE
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import Recording
from plant_emulator.signals.log import COMPARED, VOLTAGE, Log
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.estimation.unknowns import Estimate, Lengths, Residual, Unknown
    from plant_emulator.identification.identify import Identification
    from plant_emulator.signals.log import Array
    from plant_emulator.simulation.run_inputs import RunInputs

# Where in the gap a planned run may start, -1 to 1.
PLANNED_GAP_POSITIONS = (-0.8, -0.4, 0.0, 0.4, 0.8)


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
    """The program that would say most about each parameter that is not identifiable.

    recordings : the logs that were fitted
    values : all parameters, at what was found [SI]
    """
    if all(p.identifiable for p in found.parameters):
        return []
    return sharpest(found, promised_errors(found, recordings, values))


def sharpest(found: Identification, errors: Mapping[str, Array]) -> list[Experiment]:
    """The program with the least standard error of each parameter that is not identifiable.

    errors : standard errors of the parameters [unit], by program, see `promised_errors`
    """
    if not errors:
        return []
    answers = []
    for k, parameter in enumerate(found.parameters):
        if parameter.identifiable:
            continue
        program = min(errors, key=lambda name: float(errors[name][k]))
        error = float(errors[program][k])
        answers.append(
            Experiment(
                parameter=parameter.name,
                program=program,
                standard_error=error,
                enough=error <= parameter.enough,
            )
        )
    return answers


def promised_errors(
    found: Identification, recordings: Sequence[Recording], values: Mapping[str, float]
) -> dict[str, Array]:
    """Standard errors of the parameters [unit] after a run of each program, by its name.

    Each is an array of shape (parameters,), from the logs and that run without any prior. A program
    that the model cannot be driven through at these values is left out.
    """
    count = len(found.parameters)
    known = without_states(found.estimate.information, count)
    units = np.array(
        [
            u.error(p.value, 1.0)
            for u, p in zip(found.estimate.unknowns[:count], found.parameters, strict=True)
        ]
    )
    noise = noise_levels(recordings)
    errors = {}
    for program in PROGRAMS.values():
        if isinstance(program, SpeedProgram):
            planned = [
                data_errors(known + without_states(one.information, count))
                for one in _linearisations(program, found, values, noise)
            ]
            if planned:
                errors[program.name] = units * np.median(planned, axis=0)
    return errors


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


def _linearisations(
    program: SpeedProgram,
    found: Identification,
    values: Mapping[str, float],
    noise: Mapping[str, float],
) -> Iterator[Estimate]:
    """Linearise a run of the program at every start position where it can be simulated.

    A first linearisation only sets the steps of the differences.
    """
    time, reference = program.reference()
    sensors = found.parameter_set.sensors
    run = inputs_of(Log(time, {"speed_reference": reference}, program.name), sensors=sensors)
    lengths: Lengths = {}
    for position in PLANNED_GAP_POSITIONS:
        unknowns = _unknowns(found, position)
        with suppress(UnsettledError):
            residual = _planned_residual(run, {**values, **_starts(unknowns)}, noise, found.noise)
            lengths = lengths or linearise_at(unknowns, [residual]).lengths
            yield linearise_at(unknowns, [residual], lengths=lengths, symmetric=True)


def _unknowns(found: Identification, position: float) -> list[Unknown]:
    """Unknowns of a planned run: the parameters at the values found, and its initial states."""
    count = len(found.parameters)
    unknowns = found.estimate.unknowns
    parameters = [
        replace(u, start=p.value) for u, p in zip(unknowns[:count], found.parameters, strict=True)
    ]
    states = [replace(u, run=0) for u in unknowns[count:] if u.run == 0]
    return parameters + [
        replace(u, start=position) if u.name == GAP_POSITION else u for u in states
    ]


def _starts(unknowns: Sequence[Unknown]) -> dict[str, float]:
    return {u.name: u.start for u in unknowns}


def _planned_residual(
    run: RunInputs,
    there: Mapping[str, float],
    noise: Mapping[str, float],
    shown: Mapping[str, ChannelNoise],
) -> Residual:
    """Residual of a planned run whose measurement is its simulation at the values `there`.

    noise : level by channel [SI]; shown : noise that the logs have shown, over that level
    """
    values = dict(there)
    measured = simulate(
        run, values, gap_position=values.pop(GAP_POSITION), tolerance=FINAL_TOLERANCE
    )
    levels = np.array(list(noise.values()))
    planned = Recording(
        measured, run, tuple(noise), levels, np.ones((len(noise), len(run.time)), bool)
    )

    everything = np.ones(len(run.time), bool)
    whiteners = [Whitener(shown.get(name, ChannelNoise()), everything, run.time) for name in noise]

    def white(rows: Array) -> Array:
        return np.stack([w.white(row) for w, row in zip(whiteners, rows, strict=True)])

    simulated = SimulatedRun(planned.inputs, values, FINAL_TOLERANCE)
    return Changed(Changed(simulated, planned.residual_of), white)
