"""A run's position in the gap and the phase of a large ripple are found together."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from plant_emulator import effects
from plant_emulator.diagnosis.execution.pool import build_model
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import simulate

RIPPLE = '''"""The measuring wheel is not round.

    w (1 + a cos(k theta + phase))

Source: a test.
"""

from math import cos

from plant_emulator.effects import EffectParameter, Memory

SUBSYSTEM = "speed_sensor"
PARAMETERS = {
    "a": EffectParameter(
        neutral=0.0, lower=-0.1, upper=0.1, plausible=0.02, unit="1", meaning="a"
    ),
    "phase": EffectParameter(
        neutral=0.0, lower=-6.3, upper=6.3, plausible=0.0, unit="rad", meaning="phase",
        per_run=True, std=1.81,
    ),
}


def start(p):
    return 0.0


def advance(base, a, s, p):
    return base + a * s.drum_speed


MEMORIES = {"angle": Memory(start, advance)}


def measured_drum_speed(value, s, p):
    if p.oval_a == 0.0:
        return value
    return value * (1.0 + p.oval_a * cos(7.7 * s.oval_angle + p.oval_phase))
'''


@pytest.mark.parametrize("phase", [2.0, 4.0])
def test_gap_and_phase_are_those_of_the_run(
    bench_log: Callable[[str], Log], nominal: ParameterSet, tmp_path: Path, phase: float
) -> None:
    inputs = inputs_of(bench_log("bench_nominal/program1"))
    log = simulate(inputs, nominal.values(), gap_position=0.95)
    speed = log["drum_speed"]
    angle = cumulative_trapezoid(speed, log.time, initial=0)
    oval = speed * (1.0 + 0.02 * np.cos(7.7 * angle + phase))
    log = add_noise(replace(log, signals={**log.signals, "drum_speed": oval}), 1)
    file = tmp_path / "oval.py"
    file.write_text(RIPPLE)
    model = build_model(
        BenchRecipe((recording(log),), nominal, tuple(effects.names()), own=(file,))
    )
    free = {u.name: u.start for u in model.parameters}
    found = model.initial_states(0, ("oval",), {**free, "oval_a": 0.02})
    assert found[GAP_POSITION] == pytest.approx(0.95, abs=0.06)
    assert np.cos(found["oval_phase"] - phase) > 0.8
