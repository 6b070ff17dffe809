"""The program that tools/bench.py measures on, and at which tolerance each solver errs alike."""

from __future__ import annotations

from functools import cached_property, partial
from math import inf
from typing import TYPE_CHECKING

import click
import numpy as np
import peers
from timing import Action, alone

from plant_emulator import parameter_sets
from plant_emulator.signals.log import Array, Log
from plant_emulator.simulation import programs
from plant_emulator.simulation.simulate import LARGEST_STEP, inputs_of, simulate
from plant_emulator.solver.stepper import CHANNELS

if TYPE_CHECKING:
    from collections.abc import Callable

    from plant_emulator.solver import kernel

PROGRAM = "program1"
# Worst channel's NRMSD that we may have [%], and how many times ours a peer may have.
ERROR_BOUND, MORE_ERROR = 0.015, 1.25
CONVERGED = 1e-8
# Steps may pass over samples, as those of the general solvers do [s].
LONG_STEP = 0.1
# Relative tolerances, eight a decade.
LADDER = tuple(float(f"{tolerance:.3g}") for tolerance in np.geomspace(1e-2, 1e-5, 25))
TRIAL_ROUNDS = 3


class Study:
    """The emulator on the program, prepared, and what its errors are measured against."""

    def __init__(self) -> None:
        program = programs.PROGRAMS[PROGRAM]
        assert isinstance(program, programs.SpeedProgram)
        self.time, reference = program.reference()
        self.run = inputs_of(Log(self.time, {"speed_reference": reference}, PROGRAM))
        self.duration = program.duration
        last = program.corners[-1][1]
        self.corners = ((0.0, program.corners[0][1]), *program.corners, (program.duration, last))
        self.values = parameter_sets.load().values()

    def raw(self, model: kernel.Kernel, tolerance: float, step: float = LONG_STEP) -> Action:
        """The kernel's own call on inputs prepared beforehand; returns the channels."""
        run, p = self.run, model.parameter_record(self.values)
        stage, work = model.stage_record(), model.work()
        out = np.zeros((len(self.time), len(CHANNELS)))
        inputs = (run.time, run.reference, run.slope, run.corners, run.wheel_torque, run.parked)

        def action() -> Array:
            work[:] = 0.0
            x = model.state(p, 0.0)
            model.run(*inputs, (tolerance, step), x, work, stage, p, out)
            return out

        return action

    def simulated(self, tolerance: float, largest_step: float = LONG_STEP) -> Array:
        """The compared channels as users get them."""
        log = simulate(self.run, self.values, tolerance=tolerance, largest_step=largest_step)
        return np.column_stack([log[name] for name in peers.CHANNELS])

    @cached_property
    def converged(self) -> Array:
        """The compared channels at a tolerance far below all others."""
        return self.simulated(CONVERGED, LARGEST_STEP)

    def error(self, found: Array) -> float:
        """NRMSD of the worst channel against the converged solution [%]."""
        rms = np.sqrt(np.mean((found - self.converged) ** 2, axis=0))
        return float(100.0 * np.max(rms / np.ptp(self.converged, axis=0)))

    @cached_property
    def ours(self) -> tuple[float, float]:
        """Our loosest tolerance from which on every error is within the bound, and its error."""
        found, error = 0.0, inf
        for tolerance in reversed(LADDER):
            now = self.error(self.simulated(tolerance))
            if now > ERROR_BOUND:
                break
            found, error = tolerance, now
        if not found:
            raise click.ClickException(f"no tolerance down to {LADDER[-1]:g} meets the error")
        return found, error

    def fastest(self, solve: Callable[[float], Array]) -> tuple[float, float]:
        """Tolerance at which a peer is fastest among those where it errs as we do, and its error.

        A peer's error does not fall evenly with its tolerance, so that every one is tried; and as
        none gives just our error, a peer may err by MORE_ERROR times ours.
        """
        errors = {tolerance: self.error(solve(tolerance)) for tolerance in LADDER}
        good = {k: error for k, error in errors.items() if error <= MORE_ERROR * self.ours[1]}
        if not good:
            raise click.ClickException(f"no tolerance down to {LADDER[-1]:g} meets the error")
        times = {k: alone(partial(solve, k), TRIAL_ROUNDS) for k in good}
        best = min(times, key=times.__getitem__)
        return best, good[best]
