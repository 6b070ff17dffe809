"""The program of tools/bench.py, and the tolerance at which each solver has the same error."""

from __future__ import annotations

from functools import cached_property, partial
from math import inf
from typing import TYPE_CHECKING

import click
import numpy as np

from benchmark import peers
from benchmark.timing import Action, alone
from plant_emulator import parameter_sets
from plant_emulator.signals.log import Array, Log
from plant_emulator.simulation import programs
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import LARGEST_STEP, simulate
from plant_emulator.solver.stepper import CHANNELS, NO_STEPS, Inputs

if TYPE_CHECKING:
    from collections.abc import Callable

    from plant_emulator.solver import kernel

PROGRAM = "program1"
# Largest error that we may have, NRMSD of the worst channel [%]; largest ratio of a peer's to ours.
ERROR_BOUND, MORE_ERROR = 0.015, 1.25
CONVERGED = 1e-8
# Longest step [s]: steps may pass over samples, as in the general solvers.
LONG_STEP = 0.1
# Relative tolerances: eight in each decade.
LADDER = tuple(float(f"{tolerance:.3g}") for tolerance in np.geomspace(1e-2, 1e-5, 25))
TRIAL_ROUNDS = 3


class Study:
    """The emulator with the inputs of the program, and the converged solution for its errors."""

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
        """An action: call the kernel with prepared inputs; gives the channels, (n, channels)."""
        run, p = self.run, model.parameter_record(self.values)
        stage, work = model.stage_record(), model.work()
        out = np.zeros((len(self.time), len(CHANNELS)))
        inputs = Inputs(
            run.time, run.reference, run.slope, run.corners, run.wheel_torque, run.parked
        )

        def action() -> Array:
            work[:] = 0.0
            x = model.state(p, 0.0)
            model.run(inputs, (tolerance, step, 0), x, work, NO_STEPS, stage, p, out)
            return out

        return action

    def simulate(self, tolerance: float, largest_step: float = LONG_STEP) -> Array:
        """Simulate as a user does; the compared channels, shape (n, channels)."""
        log = simulate(self.run, self.values, tolerance=tolerance, largest_step=largest_step)
        return np.column_stack([log[name] for name in peers.CHANNELS])

    @cached_property
    def converged(self) -> Array:
        """The compared channels at a tolerance far below all others, shape (n, channels)."""
        return self.simulate(CONVERGED, LARGEST_STEP)

    def error(self, found: Array) -> float:
        """NRMSD of the worst channel [%], against the converged solution."""
        rms = np.sqrt(np.mean((found - self.converged) ** 2, axis=0))
        return float(100.0 * np.max(rms / np.ptp(self.converged, axis=0)))

    @cached_property
    def ours(self) -> tuple[float, float]:
        """Our loosest tolerance with all errors from there on in the bound; its error [%]."""
        found, error = 0.0, inf
        for tolerance in reversed(LADDER):
            now = self.error(self.simulate(tolerance))
            if now > ERROR_BOUND:
                break
            found, error = tolerance, now
        if not found:
            raise click.ClickException(f"no tolerance down to {LADDER[-1]:g} meets the error")
        return found, error

    def fastest(self, solve: Callable[[float], Array]) -> tuple[float, float]:
        """The peer's fastest tolerance, among those with an error like ours, and the error [%].

        The error of a peer does not fall evenly with its tolerance. Hence every tolerance is tried.
        No tolerance gives exactly our error. Hence the peer may have MORE_ERROR times our error.
        """
        errors = {tolerance: self.error(solve(tolerance)) for tolerance in LADDER}
        good = {k: error for k, error in errors.items() if error <= MORE_ERROR * self.ours[1]}
        if not good:
            raise click.ClickException(f"no tolerance down to {LADDER[-1]:g} meets the error")
        times = {k: alone(partial(solve, k), TRIAL_ROUNDS) for k in good}
        best = min(times, key=times.__getitem__)
        return best, good[best]
