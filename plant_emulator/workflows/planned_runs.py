"""Runs that were recorded, or are only planned, ready for the question what they can show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.machines.bench import BenchModel, BenchRecipe
from plant_emulator.errors import ParameterError
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import Recording
from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.programs import PROGRAMS
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.simulate import run_of
from plant_emulator.workflows.loading import admitted
from plant_emulator.workflows.simulation import simulated

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.model.parameters import ParameterSet


def planned_run(
    name: str, parameters: ParameterSet, channels: tuple[str, ...] = COMPARED
) -> Recording:
    """A drive program as it would be recorded, without noise but judged by the sensors' noise."""
    log = simulated(name, parameters, {}, hold=None, start="middle")
    return Recording(
        log,
        run_of(log),
        channels,
        np.array([SENSORS[channel][0] for channel in channels]),
        np.ones((len(channels), len(log.time)), bool),
    )


def prepared(
    names: Sequence[str], parameters: ParameterSet, hold: str | None = None
) -> tuple[BenchModel, FitResult, tuple[str, ...]]:
    """A model of these logs and programs, the fit at which they are judged, and what was noted.

    Logs are fitted; programs are simulated at what the logs say, or at the set as given.
    """
    recorded = [name for name in names if name not in PROGRAMS or Path(name).is_file()]
    for name in recorded:
        if not Path(name).exists():
            known = ", ".join(PROGRAMS)
            raise ParameterError(f"{name}: neither a log file nor a program; known: {known}")
    recordings, notes = admitted(recorded, parameters, hold)
    values = parameters.values()
    states: tuple[dict[str, float], ...] = ()
    if recordings:
        model = BenchRecipe(tuple(recordings), parameters).build()
        fitted = fit_null(model, range(len(recordings)))
        parameters = parameters.with_values(fitted.values)
        values, states = parameters.values(), tuple(dict(s) for s in fitted.states)
    planned = [name for name in names if name not in recorded]
    channels = max((r.channels for r in recordings), key=len, default=COMPARED)
    recordings += [planned_run(name, parameters, channels) for name in planned]
    model = BenchRecipe(tuple(recordings), parameters).build()
    point = FitResult(
        effects=(),
        values={u.name: values[u.name] for u in model.parameters},
        states=(*states, *({GAP_POSITION: 0.0} for _ in planned)),
        cost=0.0,
        sum_of_squares=0.0,
        samples=1,
        effective_fraction=1.0,
        standard_errors={},
        converged=True,
    )
    return model, point, tuple(notes)
