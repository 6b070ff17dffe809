"""Residuals of runs as functions of the unknowns of a fit (pure)."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.estimation.nearby import Changed, OrImpossible
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.input_noise import noise_directions
from plant_emulator.recordings.recording import IMPOSSIBLE
from plant_emulator.simulation.law_forms import size_factors, split_law_forms
from plant_emulator.simulation.simulate import FIT_TOLERANCE, Settings, simulate_with_steps
from plant_emulator.solver.stepper import NO_STEPS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.estimation.unknowns import Estimate, Residual
    from plant_emulator.recordings.input_noise import NoiseDirections
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array, Log
    from plant_emulator.simulation.run_inputs import RunInputs
    from plant_emulator.simulation.simulate import MeasuredSpeeds


@dataclass
class SimulatedRun:
    """The simulated log of a run as a function of the unknowns; see `nearby.Stepped`.

    values : of everything that is not unknown [SI]
    tolerance, largest_step, along, follow : see `simulate`
    measured : the log of the run, where coefficients of other forms of a law may be among the
        unknowns, see `simulation.law_forms`
    """

    inputs: RunInputs
    values: Mapping[str, float]
    tolerance: float = FIT_TOLERANCE
    largest_step: float | None = None
    along: MeasuredSpeeds | None = None
    follow: Array = field(default_factory=lambda: NO_STEPS)
    measured: Log | None = None
    _last: tuple[dict[str, float] | None, Array] = field(
        default=(None, NO_STEPS), init=False, repr=False
    )

    def __call__(self, found: Mapping[str, float], /) -> Log:
        """The log that the run would have given at these values.

        Raises UnsettledError where the equations were not solved.
        """
        values, gap = split_gap_position({**self.values, **found})
        factors: Mapping[str, Array] = {}
        if self.measured is not None:
            values, forms = split_law_forms(values)
            factors = size_factors(forms, self.measured)
        settings = Settings(
            gap, self.tolerance, self.largest_step, self.along, self.follow, factors
        )
        try:
            log, steps = simulate_with_steps(self.inputs, values, settings)
        except UnsettledError:
            if not len(self.follow):
                raise
            log, steps = simulate_with_steps(
                self.inputs, values, settings._replace(follow=NO_STEPS)
            )
        self._last = dict(found), steps
        return log

    def near(self, found: Mapping[str, float], /) -> SimulatedRun:
        """See `Stepped`; nothing is simulated where these values were the last ones."""
        if self._last[0] != found:
            with suppress(UnsettledError):
                self(found)
        return replace(self, follow=self._last[1] if self._last[0] == found else NO_STEPS)


def run_residual(
    recording: Recording,
    values: Mapping[str, float],
    tolerance: float = FIT_TOLERANCE,
    largest_step: float | None = None,
    along: MeasuredSpeeds | None = None,
) -> Residual:
    """Whitened residual of a run as a function of the unknowns, shape (channels, samples).

    Where the model cannot be simulated, every sample is IMPOSSIBLE.

    values : of everything that is not unknown [SI]
    tolerance, largest_step, along : see `simulate`
    """
    run = SimulatedRun(
        recording.inputs, values, tolerance, largest_step, along, measured=recording.log
    )
    impossible = np.where(recording.use, IMPOSSIBLE, 0.0)
    return OrImpossible(Changed(run, recording.residual_of), impossible)


def whiten_function(residual: Residual, noise: NoiseDirections | None) -> Residual:
    """The residual function, whitened for the noise of a measured input; None: as it is."""
    return residual if noise is None else Changed(residual, noise.whiten)


def residual_functions(
    recordings: Sequence[Recording],
    values: Mapping[str, float],
    free: Sequence[str],
    tolerance: float = FIT_TOLERANCE,
) -> list[Residual]:
    """Residual function of every run.

    values : of all parameters [SI]; those in `free` are among the unknowns
    """
    fixed = {n: v for n, v in values.items() if n not in free}
    return [run_residual(r, {**fixed, **r.logged_values}, tolerance) for r in recordings]


def whiten_functions(
    recordings: Sequence[Recording],
    values: Mapping[str, float],
    free: Sequence[str],
    near: Estimate,
) -> list[Residual] | None:
    """Residual function of every run, whitened for the noise of its measured input.

    near : the fit at which the effect of that noise is taken; other arguments as those of
        `residual_functions`
    None: the noise counts in no run.
    """
    noise = []
    for k, recording in enumerate(recordings):
        there = {**values, **recording.logged_values, **near.parameters(), **near.states(k)}
        noise.append(noise_directions(recording, *split_gap_position(there)))
    if not any(noise):
        return None
    plain = residual_functions(recordings, values, free)
    return [whiten_function(r, directions) for r, directions in zip(plain, noise, strict=True)]
