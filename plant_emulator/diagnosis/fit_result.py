"""What a fit found: the result of a joint fit, and of the fit of a random effect."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class FitResult:
    """Where a joint fit has come to.

    values : parameters, sizes and shapes by name; states : of every run of the fit, by name
    cost : sum of squares with the priors, and what the looks cost; squares : of the residuals
        alone; samples : counted
    share : of the samples that are independent, from the residual's autocorrelation time
    errors : standard errors by name of `values`
    structure : of the residuals, beyond white noise, see `covariance.structure`
    looks : of the cost, what the choice of the states has gained by chance, see `looks_of`
    sizes : the largest size of every effect, in plausible sizes
    unsure : effects with values of each run and no certain size; those can be anything that differs
        from run to run
    """

    effects: tuple[str, ...]
    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]
    cost: float
    squares: float
    samples: int
    share: float
    errors: Mapping[str, float]
    converged: bool
    structure: float = 0.0
    looks: float = 0.0
    sizes: Mapping[str, float] = field(default_factory=dict)
    unsure: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """The same for the same fit only."""
        return (self.effects, self.cost, *self.values.values())

    @property
    def chi_squared(self) -> float:
        """Mean square of the whitened residual; 1: only the noise is left."""
        return self.squares / self.samples


@dataclass(frozen=True, kw_only=True)
class Unrest:
    """An effect of chance course on top of a fit.

    size, error : a with its standard error, in the unit of `name`
    shape : constants that only shape the effect, by name
    evidence : twice the rise of the log-likelihood
    weights : 1 / sqrt(1 + a^2 v) of every run, shape (channels, samples)
    even : whether what is left is as small as it says at every level
    random : whether what is left is random
    """

    effect: str
    name: str
    size: float
    error: float
    shape: Mapping[str, float]
    evidence: float
    weights: tuple[Array, ...]
    even: bool
    random: bool

    @property
    def holds(self) -> bool:
        """Whether the residual is what the effect leaves."""
        return self.even and self.random
