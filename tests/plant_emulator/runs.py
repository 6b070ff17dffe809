"""Runs for tests: logs of inputs made by hand, and the kernel driven from any state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np
import pytest

from plant_emulator.signals.log import Array, Log
from plant_emulator.simulation.programs import sample_times
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate as simulate_run
from plant_emulator.solver import compiler
from plant_emulator.solver.kernel import Kernel, kernel
from plant_emulator.solver.stepper import NO_STEPS, Inputs

needs_compiler = pytest.mark.skipif(
    not compiler.ENABLED, reason="is about the compiler, which NUMBA_DISABLE_JIT switches off"
)

INT_SPEED, INT_CURRENT, CURRENT, MOTOR, TWIST, GEAR, BACKLASH, DRUM = range(8)


def linear(*corners: tuple[float, float], duration: float, period: float = 0.01) -> Log:
    """Inputs of a run: a reference that is linear between its corners (s, rad/s)."""
    time = sample_times(duration, period)
    points, speeds = zip(*corners, strict=True)
    return Log(time, {"speed_reference": np.interp(time, points, speeds)}, "by hand")


def with_truck(inputs: Log, wheel_torque: Array) -> Log:
    """Inputs with a truck on the drum [N m at its wheel]."""
    return Log(inputs.time, {**inputs.signals, "wheel_torque": wheel_torque}, inputs.source)


def simulate(inputs: Log, values: Mapping[str, float], **options: Any) -> Log:
    """Simulate inputs made by hand."""
    return simulate_run(inputs_of(inputs), values, **options)


@dataclass
class Piecewise:
    """The compiled bench under a reference that is linear from call to call, without dead time.

    x : the states, to be read and written between calls (see stage.STATES)
    """

    values: Mapping[str, float]
    gap_position: float = 0.0
    tolerance: float = 1e-6
    step: float | None = None
    time: float = 0.0
    reference: float = 0.0
    model: Kernel = field(default_factory=kernel)

    def __post_init__(self) -> None:
        self.p = self.model.parameter_record({**self.values, "dead_time": 0.0})
        self.x = self.model.state(self.p, self.gap_position * self.values["backlash_half_gap"])

    def to(
        self, time: float, reference: float, *, wheel_torque: float = 0.0, pieces: int = 1
    ) -> Array:
        """Go on to that time; channels at the ends of the pieces, shape (pieces + 1, channels)."""
        times = np.linspace(self.time, time, pieces + 1)
        references = np.linspace(self.reference, reference, pieces + 1)
        slope = np.full(pieces + 1, (reference - self.reference) / (time - self.time))
        out = np.zeros((pieces + 1, 7))
        settings = (self.tolerance, 0.01, 0) if self.step is None else (inf, self.step, 0)
        torque = np.full(pieces + 1, wheel_torque)
        free = np.zeros(pieces + 1)
        work, stage = self.model.work(), self.model.stage_record()
        inputs = Inputs(times, references, slope, np.array([]), torque, free)
        self.model.run(inputs, settings, self.x, work, NO_STEPS, stage, self.p, out)
        self.time, self.reference = time, reference
        return out


def largest(values: Sequence[float] | Array) -> float:
    """Largest size in a vector."""
    return float(np.max(np.abs(values)))
