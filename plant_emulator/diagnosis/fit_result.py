"""What a fit found: values, the result of a joint fit, and that of a random effect."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.estimation.unknowns import Lengths
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class FitValues:
    """Values at which a model with some effects can be simulated and linearised.

    values : parameters, sizes and shapes by name
    states : the initial states of each run by name, one mapping a run
    lengths : of the slopes near there, see `Estimate.lengths`; empty where they are not known
    """

    effects: tuple[str, ...]
    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]
    lengths: Lengths = field(default_factory=dict)

    def moved_to(self, other: FitValues) -> Self:
        """This fit with its own parameters and states as another fit of the same runs has them.

        Its cost and its errors stay those of its own place.
        """
        states = tuple(
            {name: moved[name] for name in own}
            for own, moved in zip(self.states, other.states, strict=True)
        )
        values = {name: other.values[name] for name in self.values}
        return replace(self, values=values, states=states, lengths=other.lengths)

    def of_runs(self, kept: Sequence[int]) -> Self:
        """This fit with the states of some of its runs, which are numbered from 0."""
        number: dict[int | None, int | None] = {None: None}
        number |= {run: k for k, run in enumerate(kept)}
        return replace(
            self,
            states=tuple(self.states[run] for run in kept),
            lengths={
                (name, number[run]): length
                for (name, run), length in self.lengths.items()
                if run in number
            },
        )


@dataclass(frozen=True, kw_only=True)
class FitResult(FitValues):
    """The result of a joint fit of parameters, states and effects, as plain data.

    cost : sum of squares, plus the priors' penalty, plus the Occam penalty
    sum_of_squares : of the whitened residuals alone
    samples : number of samples that count
    effective_fraction : share of the samples that are independent, from the residual's
        autocorrelation time
    standard_errors : of `values`, by name; of the final fit of a search, with those of the laws
    converged : whether the fit ended before its iterations did
    ljung_box_excess : Ljung-Box statistic of the residuals beyond its expected value, summed over
        the channels; see `covariance.structure`
    occam_penalty : part of the cost that charges the choice of sizes, shapes and states
    insignificant : effects with states of their own and no size that differs from neutral for
        certain; such an effect can follow anything that differs from run to run
    """

    cost: float
    sum_of_squares: float
    samples: int
    effective_fraction: float
    standard_errors: Mapping[str, float]
    converged: bool
    ljung_box_excess: float = 0.0
    occam_penalty: float = 0.0
    insignificant: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """Hashable key that only an equal fit shares."""
        return (self.effects, self.cost, *self.values.values())

    @property
    def mean_square(self) -> float:
        """Mean square of the whitened residual [1]; 1 where only the noise is left."""
        return self.sum_of_squares / self.samples


@dataclass(frozen=True, kw_only=True)
class VarianceComponent:
    """The result of the fit of a random effect on top of a joint fit.

    parameter : name of the effect's size
    size, standard_error : estimate of a in the variance 1 + a^2 v, in the parameter's unit
    shape : constants that only shape the effect, by name
    evidence : twice the rise of the log-likelihood
    weights : 1 / sqrt(1 + a^2 v) of each run, shape (channels, samples)
    unopposed : whether no run is much less likely with this size than without the effect
    homoscedastic : whether the weighted residual has the same variance at each level of v
    white : whether the weighted residual is nearly white
    """

    effect: str
    parameter: str
    size: float
    standard_error: float
    shape: Mapping[str, float]
    evidence: float
    weights: tuple[Array, ...]
    unopposed: bool
    homoscedastic: bool
    white: bool

    @property
    def consistent(self) -> bool:
        """Whether the residual is what the random effect leaves."""
        return self.unopposed and self.homoscedastic and self.white

    @property
    def coloured(self) -> bool:
        """Whether all but the colour of the residual is what the random effect leaves."""
        return self.unopposed and self.homoscedastic and not self.white
