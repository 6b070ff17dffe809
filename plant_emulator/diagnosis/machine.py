"""What the diagnosis asks of a machine: parameters, effects, states, and simulated residuals.

The bench is one such machine, a single motor-driven axis another; nothing else here knows either.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.answer import Location
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.recordings.input_noise import NoiseDirections
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class DerivedQuantity:
    """A quantity that the field knows an effect by, such as a coefficient of either direction.

    of : its value [unit] from the values of a fit by name
    """

    name: str
    unit: str
    of: Callable[[Mapping[str, float]], float]


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that the nominal model lacks.

    sizes : its unknowns that are absent at their neutral value, starting at a plausible one
    shapes : its unknowns that only shape it, each with a prior
    states : its unknowns of one run only
    neutral : values of the sizes at which the effect is absent
    fixed : values of the rest while the effect is there
    units : of all its parameters, by name
    title : what it is, in one line; needs : what a log must have to show it, empty: nothing special
    stochastic : its unknowns of one run that no fit and no measurement tells: its course is chance
    derived : what else it is known by, made of its own values and the machine's
    exact_form : its law can have no other form, so that it leaves nothing where it is the cause
    """

    name: str
    subsystem: str
    sizes: tuple[Unknown, ...]
    shapes: tuple[Unknown, ...]
    states: tuple[Unknown, ...]
    neutral: Mapping[str, float]
    fixed: Mapping[str, float]
    units: Mapping[str, str]
    title: str
    needs: str = ""
    stochastic: tuple[Unknown, ...] = ()
    derived: tuple[DerivedQuantity, ...] = ()
    exact_form: bool = False


@dataclass(frozen=True, kw_only=True)
class MeasuredRun:
    """A measured run.

    time : of its samples [s], shape (n,); measured : shape (channels, n) [units]
    noise : standard deviation of each channel's noise, shape (channels,) [units]
    measured_input : whether an input of its simulation is a measurement with noise of its own
    """

    source: str
    channels: tuple[str, ...]
    units: tuple[str, ...]
    time: Array
    measured: Array
    noise: Array
    measured_input: bool = False


class Model(Protocol):
    """A machine that can be simulated, and the runs that it was given."""

    @property
    def runs(self) -> Sequence[MeasuredRun]:
        """The measured runs."""

    @property
    def parameters(self) -> tuple[Unknown, ...]:
        """Parameters that drift, with their priors; the prior's mean is the nominal value."""

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the parameters by name."""

    @property
    def subsystems(self) -> Mapping[str, str]:
        """Where each parameter belongs, by name."""

    @property
    def reaches_noise(self) -> bool:
        """Whether with the right effects nothing but the noise is left.

        A machine modelled down to its sensors does; one modelled in outline leaves a rest, and a
        cause is then known by its evidence alone.
        """

    @property
    def states(self) -> tuple[Unknown, ...]:
        """States of a run, without those of effects."""

    @property
    def candidates(self) -> Mapping[str, Candidate]:
        """The library of effects by name."""

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """With these effects there: from values by name to the whitened residual.

        Measured minus simulated over the noise, shape (channels, samples); 0: does not count.
        """

    def input_noise(
        self, run: int, where: FitResult, state: Mapping[str, float]
    ) -> NoiseDirections | None:
        """What the noise of the run's fed inputs does to it at a fit; see `fed_noise`."""

    def nominal(self, runs: Sequence[int]) -> Mapping[str, float]:
        """The parameters as given; of a machine without such, what these runs tell of them."""

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """Parameters, and the states of each of these runs, near the best fit without effects."""

    def initial_states(
        self, run: int, effects: Sequence[str], values: Mapping[str, float]
    ) -> dict[str, float]:
        """States of a run near the best at these values of everything else."""

    def locate(self, where: FitResult, runs: Sequence[int]) -> Location | None:
        """Where the gap of a fit without effects lies, without any hypothesis of its cause.

        None: this machine has no blocks to tell apart.
        """

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Model:
        """The machine with runs that it has not shown yet behind its own, the least effort first.

        As the fit of these runs predicts them, without noise, judged by its own runs' noise; their
        source tells a person what to do. A machine that plans no runs has its own only.
        """

    def missing_experiments(self, runs: Sequence[int]) -> Mapping[str, Sequence[str]]:
        """By subsystem: what would tell more of it and is in none of these runs."""
