"""The long steps of a diagnosis beside those of a simulation."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator import effects
from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import GAP_POSITION, split_gap_position
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.simulate import FIT_TOLERANCE, simulate


@pytest.mark.parametrize("name", effects.names())
def test_no_effect_needs_shorter_steps(
    name: str, bench_log: Callable[[str], Log], nominal: ParameterSet
) -> None:
    """No step control watches memories of effects: long steps must miss little more than short."""
    run = recording(bench_log("bench_nominal/program1"))
    model = BenchModel([run], nominal, {name: effects.load(name)})
    candidate = model.candidates[name]
    plain = {u.name: u.start for u in (*candidate.shapes, *candidate.states, *candidate.stochastic)}
    values = model.nominal([0]) | values_at_size(candidate, 0.3) | plain | {GAP_POSITION: 0.3}
    own, gap = split_gap_position(model.fixed_values(0, (name,)) | values)
    fine = run.residual_of(
        simulate(run.inputs, own, gap_position=gap, tolerance=1e-8, largest_step=1e-3)
    )
    short = run.residual_of(simulate(run.inputs, own, gap_position=gap, tolerance=FIT_TOLERANCE))
    missed = np.linalg.norm(model.residual(0, (name,))(values) - fine)
    assert missed < 1.2 * np.linalg.norm(short - fine) + 0.1
