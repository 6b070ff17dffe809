"""Quantities to be estimated, and what an estimation found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from plant_emulator.estimation.covariance import data_errors
from plant_emulator.signals.log import Array

# From the values by name to one run's whitened residual, shape (channels, samples).
Residual = Callable[[Mapping[str, float]], Array]
# Norms of the slopes of unknowns, by name and run.
Lengths = Mapping[tuple[str, int | None], float]
# Values that the start of a state is looked for among.
STATE_STARTS = 9


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """A quantity to be estimated; start, lower and upper in its own unit.

    logarithmic : estimated on a logarithmic scale, for what cannot be negative
    scale : of what is not: a change that matters [its unit]
    prior, std : mean and standard deviation of what is known beforehand; std None: nothing
    run : the run whose state it is; None: a parameter of all runs
    step : between the starts that it is looked for among; None: of a state there are STATE_STARTS
    angle : whether it is an angle, of which a small effect is a cosine
    """

    name: str
    start: float
    lower: float
    upper: float
    logarithmic: bool = True
    scale: float = 1.0
    prior: float = 0.0
    std: float | None = None
    run: int | None = None
    step: float | None = None
    angle: bool = False

    @property
    def plain(self) -> bool:
        """Whether it is neither an angle nor one with many narrow basins."""
        return not self.angle and self.step is None

    def starts(self) -> list[float]:
        """Values of a state, evenly over its prior, or over its bounds without one [its unit]."""
        low, high = self.lower, self.upper
        if self.std is not None:
            reach = np.sqrt(3.0) * self.std  # of an even spread
            low, high = max(low, self.prior - reach), min(high, self.prior + reach)
        count = STATE_STARTS if self.step is None else 1 + int(np.ceil((high - low) / self.step))
        return [float(value) for value in np.linspace(low, high, count)]

    def scaled(self, value: float) -> float:
        """The value on the scale of the estimation."""
        return float(np.log(value)) if self.logarithmic else value / self.scale

    def value(self, scaled: float) -> float:
        """The value [its unit] of a number on the scale of the estimation."""
        return float(np.exp(scaled)) if self.logarithmic else scaled * self.scale

    def error(self, value: float, scaled_error: float) -> float:
        """Standard error in the unit of the value."""
        return (value if self.logarithmic else self.scale) * scaled_error

    @property
    def scaled_std(self) -> float:
        """Prior standard deviation on the scale of the estimation; infinite without prior."""
        if self.std is None:
            return float("inf")
        return self.std / (self.prior if self.logarithmic else self.scale)


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """The result of a fit; z is on the scale of the estimation, shape (unknowns,).

    residuals, jacobians : one a run, shape (channels, samples) and (channels, samples, unknowns)
    cost : sum of squares of the whitened residuals, without the priors
    covariance : of z, with the residuals' autocorrelation and the priors; of a rough fit that of
        white residuals of variance 1
    information : J' J of z, from the data alone
    """

    unknowns: tuple[Unknown, ...]
    z: Array
    residuals: tuple[Array, ...]
    jacobians: tuple[Array, ...]
    covariance: Array
    information: Array
    cost: float
    penalty: float
    samples: int
    simulations: int
    converged: bool
    message: str

    def parameters(self) -> dict[str, float]:
        """Values of the parameters by name [SI]."""
        return {u.name: u.value(z) for u, z in self._pairs() if u.run is None}

    def states(self, run: int) -> dict[str, float]:
        """Values of the states of one run by name [SI]."""
        return {u.name: u.value(z) for u, z in self._pairs() if u.run == run}

    def _pairs(self) -> list[tuple[Unknown, float]]:
        return [(u, float(z)) for u, z in zip(self.unknowns, self.z, strict=True)]

    @property
    def lengths(self) -> Lengths:
        """Norm of the slopes of each unknown over all runs, by its name and run."""
        norms = column_lengths(self.jacobians)
        return {(u.name, u.run): float(n) for u, n in zip(self.unknowns, norms, strict=True)}

    @property
    def standard_errors(self) -> Array:
        """Standard errors of z, shape (unknowns,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def data_errors(self) -> Array:
        """Standard errors of z that these data give without any prior; may be infinite.

        As much larger than white residuals of variance 1 would make them as those with prior are.
        """
        precision = np.diag([u.scaled_std**-2.0 for u in self.unknowns])
        white = data_errors(self.information + precision)
        known = np.isfinite(white)
        larger = np.where(known, self.standard_errors, 1.0) / np.where(known, white, 1.0)
        return data_errors(self.information) * np.maximum(1.0, larger)

    def occam_penalty(self, priors: Sequence[Unknown | None]) -> float:
        """Cost of the freedom to choose some unknowns [chi squared].

        A phase and a frequency fit any noise a little, and so does a size far below the plausible
        one. The penalty of unknowns with a prior is

            -log det(P C)

        P : precision of the prior; C : covariance after the fit
        With the penalty the cost falls as twice the logarithm of the probability with these
        unknowns integrated out (Laplace's approximation; Occam factor of D. MacKay, Neural
        Computation 4 (1992) 415).

        priors : of the unknowns, in their order; None: not charged. A prior that the fit did not
            have narrows the covariance first; an unknown that the data do not show costs nothing
        """
        shown = np.isfinite(self.standard_errors)
        pairs = [(j, u) for j, u in enumerate(priors) if u is not None and u.std and shown[j]]
        if not pairs:
            return 0.0
        own = [j for j, _ in pairs]
        deviations = np.array([u.scaled_std for _, u in pairs])
        covariance = self.covariance[np.ix_(own, own)] / np.outer(deviations, deviations)
        new = np.diag([float(self.unknowns[j].std is None) for j in own])
        # (C^-1 + P)^-1 = (1 + C P)^-1 C
        narrowed = np.linalg.solve(np.eye(len(own)) + covariance @ new, covariance)
        return max(0.0, -float(np.linalg.slogdet(narrowed).logabsdet))

    @property
    def correlation(self) -> Array:
        """Correlation matrix of z, shape (unknowns, unknowns)."""
        error = self.standard_errors
        known = np.isfinite(error) & (error > 0.0)
        covariance = np.where(np.outer(known, known), self.covariance, 0.0)
        safe = np.where(known, error, 1.0)
        return np.where(np.eye(len(error)) > 0.0, 1.0, covariance / np.outer(safe, safe))

    @property
    def condition_number(self) -> float:
        """Condition number of the Jacobian on the scale of the estimation [1]."""
        singular = np.sqrt(np.clip(np.linalg.eigvalsh(self.information), 0.0, None))
        return float(singular[-1] / singular[0]) if singular[0] > 0.0 else float("inf")


def column_lengths(jacobians: Sequence[Array]) -> Array:
    """Norm of the column of each unknown, shape (unknowns,)."""
    squares = np.sum([np.einsum("cnj,cnj->j", j, j) for j in jacobians], axis=0)
    return np.asarray(np.sqrt(np.maximum(squares, 1e-300)))
