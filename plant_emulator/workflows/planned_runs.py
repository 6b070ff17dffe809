"""Recorded and planned runs in one model, for the question what they can show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitValues
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.machines.bench import BenchModel, BenchRecipe
from plant_emulator.errors import ParameterError
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import Recording
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.programs import PROGRAMS
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import noise_of
from plant_emulator.workflows.loading import load_recordings
from plant_emulator.workflows.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.model.parameters import ParameterSet


def planned_run(
    name: str, parameters: ParameterSet, channels: tuple[str, ...] = COMPARED
) -> Recording:
    """The recording of a drive program without noise, which the sensors' noise judges."""
    log = simulate(name, parameters=parameters, start="middle")
    return Recording(
        log,
        inputs_of(log, sensors=parameters.sensors),
        channels,
        np.array([noise_of(channel, parameters.sensors) for channel in channels]),
        np.ones((len(channels), len(log.time)), bool),
    )


def prepare(
    runs: Sequence[str | Path | Log], parameters: ParameterSet, reference: str | None = None
) -> tuple[BenchModel, FitValues, tuple[str, ...]]:
    """A model of logs and planned programs, the values at which they are judged, and notes.

    Logs are fitted. Programs are simulated at what the logs say, or at the set as given.
    reference : what holds between samples of the reference; None: as the log says
    Raises ParameterError for a name that is neither a log file nor a program.
    """
    recorded = [run for run in runs if not _is_program(run)]
    recordings, notes = load_recordings(recorded, parameters, reference, common_channels=True)
    states: tuple[Mapping[str, float], ...] = ()
    if recordings:
        fitted = fit_null(
            BenchRecipe(tuple(recordings), parameters).build(), range(len(recordings))
        )
        parameters, states = parameters.with_values(fitted.values), fitted.states
    programs = [str(run) for run in runs if _is_program(run)]
    channels = max((r.channels for r in recordings), key=len, default=COMPARED)
    recordings += [planned_run(name, parameters, channels) for name in programs]
    model = BenchRecipe(tuple(recordings), parameters).build()
    values = parameters.values()
    at = FitValues(
        effects=(),
        values={u.name: values[u.name] for u in model.parameters},
        states=(*states, *({GAP_POSITION: 0.0} for _ in programs)),
    )
    return model, at, tuple(notes)


def _is_program(run: str | Path | Log) -> bool:
    if isinstance(run, Log) or Path(run).is_file():
        return False
    if run not in PROGRAMS and not Path(run).exists():
        known = ", ".join(PROGRAMS)
        raise ParameterError(f"{run}: neither a log file nor a program; known: {known}")
    return run in PROGRAMS
