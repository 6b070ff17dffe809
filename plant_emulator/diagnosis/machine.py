"""What the diagnosis asks of a machine: parameters, effects, states, and simulated residuals.

The bench is such a machine (`machines`): it is modelled down to the noise of its sensors. The rooms
that search, fit and predict know a machine only as the `Model` of this module.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import Location
    from plant_emulator.diagnosis.fidelity import Fidelity
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.estimation.noise.channel_noise import Whitener
    from plant_emulator.estimation.unknowns import Residual, Unknown
    from plant_emulator.recordings.input_noise import NoiseDirections
    from plant_emulator.signals.log import Array

    Whiteners = Mapping[int, Sequence[Whitener]]


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that the nominal model lacks, as unknowns of a fit.

    sizes : unknowns that are neutral where the effect is absent; they start at a plausible size
    shapes : unknowns that only shape the effect, each with a prior
    states : unknowns that each run has of its own
    neutral : values of the sizes at which the effect is absent
    fixed : values of the parameters that no fit changes
    units : of all parameters of the effect, by name
    title : the effect in one line
    needs : what a log must have to show the effect; empty where it needs nothing special
    stochastic : unknowns of each run that follow chance, so that no fit and no measurement finds
        them; empty for an effect that is not random
    exact_form : whether its law can have no other form, as a factor or an offset; such a law leaves
        nothing where it is the cause
    forms : names of the coefficients of other forms of its law [1], see
        `simulation.law_forms`; a residual with the effect takes them among its values
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
    exact_form: bool = False
    forms: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class MeasuredRun:
    """A measured run of the machine.

    source : name of the log
    time : of the samples [s], shape (n,)
    measured : the channels [units], shape (channels, n)
    noise : standard deviation of each channel's noise [units], shape (channels,)
    noise_ratio : deviation of each sample's noise over its channel's [1], shape (channels, n);
        (channels, 1) where all samples are alike
    uncertain_inputs : whether an input of the simulation is a measurement with noise of its own, or
        is not known in a hole of the log or at a row that was taken early or late
    hides : effects that an unknown input of the run explains, or that need an input it lacks
    """

    source: str
    channels: tuple[str, ...]
    units: tuple[str, ...]
    time: Array
    measured: Array
    noise: Array
    noise_ratio: Array
    uncertain_inputs: bool = False
    hides: frozenset[str] = frozenset()


@dataclass(frozen=True, kw_only=True)
class Course:
    """The simulated course of a run.

    channels : simulated values of the run's channels [units], shape (channels, n)
    turns : angle of the machine at the samples [turns], shape (n,); None: no part of it turns
    """

    channels: Array
    turns: Array | None


class Model(Protocol):
    """A machine that can be simulated, with its measured runs."""

    @property
    def runs(self) -> Sequence[MeasuredRun]:
        """The measured runs; all methods name a run by its number in this sequence."""

    @property
    def parameters(self) -> tuple[Unknown, ...]:
        """The nuisance parameters, with their priors; a prior's mean is the nominal value."""

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the parameters, by name."""

    @property
    def subsystems(self) -> Mapping[str, str]:
        """Subsystem of each parameter, by name."""

    @property
    def states(self) -> tuple[Unknown, ...]:
        """The initial states of a run, without the states of effects."""

    @property
    def candidates(self) -> Mapping[str, Candidate]:
        """The library of effects, by name."""

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """Give the whitened residual of a run with these effects, as a function of the values.

        The residual is measured minus simulated over the noise [1], shape (channels, samples); it
        is exactly 0 where a sample does not count.
        """

    def unwhitened_residual(self, run: int, effects: Sequence[str]) -> Residual:
        """Give the residual over the deviation of the noise, whose colour is left in it.

        It is the same as `residual` where the noise is white.
        """

    def observer(self, interval: float) -> Model:
        """Give the machine with residuals that are led along the measured outputs.

        A fault then shows where and when it acts, and does not move all that follows: the cost has
        far fewer local minima than that of a free simulation. White noise leads nothing: a right
        simulation is the free one.

        interval : between two corrections [s]
        """

    def input_noise(
        self, run: int, where: FitResult, state: Mapping[str, float]
    ) -> NoiseDirections | None:
        """Find what the noise of the run's measured inputs does to its residual at a fit.

        state : of the run, by name
        None: the run has no measured input, or its noise does not count
        """

    def course(
        self, run: int, effects: Sequence[str], values: Mapping[str, float]
    ) -> Course | None:
        """Simulate a run at these values; None: it cannot be simulated there."""

    def nominal(self, runs: Sequence[int]) -> Mapping[str, float]:
        """Nominal parameters by name: the given ones, or an estimate from these runs."""

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """Find parameters, and the states of each of these runs, near the fit without effects."""

    def initial_states(
        self, run: int, effects: Sequence[str], values: Mapping[str, float]
    ) -> dict[str, float]:
        """Find states of a run near the best ones, with all other values as given."""

    def relations(
        self, where: FitResult, runs: Sequence[int], whiteners: Whiteners | None = None
    ) -> Fidelity | None:
        """Give the parity relations around a fit; None: the machine has none there.

        whiteners : of the channels by run, which know the samples that do not count
        """

    def locate(self, where: FitResult, runs: Sequence[int]) -> Location | None:
        """Find the subsystem that holds the gap of a fit, without a hypothesis of its cause.

        None: the machine has no blocks that could be told apart
        """

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Model:
        """Give the machine with planned runs behind its own, the run of least effort first.

        A planned run is simulated at the fit, without noise, and is judged by the noise of the
        machine's own runs. Its source says what to do. A machine without planned runs gives itself.
        """

    def missing_experiments(self, runs: Sequence[int]) -> Mapping[str, Sequence[str]]:
        """Manoeuvres, by subsystem, that would excite it and that no run contains."""
