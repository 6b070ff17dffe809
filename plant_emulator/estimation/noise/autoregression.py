"""Autoregressive noise, from residuals that may have holes (pure).

    u(t) = sum_k a_k u(t - k) + innovation

Levinson's recursion gives the predictors of all orders from the autocovariance (L. Ljung, System
Identification (1999), section 10.1). A hole breaks a series: the samples behind it are predicted
from each other only, by predictors of lower order. A hole so costs a few samples and invents none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

# A step of time over the usual step that breaks a series.
BREAK = 1.5
# Behind a hole a long memory is used once it is whole, and until then so much of it [samples]: what
# lies further back says little, and a predictor of each order would take most of the time.
SHORT = 12
# Least share of the variance that a predictor leaves [1]: no noise is more predictable.
LEAST_LEFT = 1e-4


@dataclass(frozen=True, kw_only=True)
class Autoregression:
    """Autoregressive noise.

    predictors : coefficients a of the orders 0, 1, ..., p
    deviations : standard deviations of the innovations of the same orders
    """

    predictors: tuple[Array, ...] = (np.zeros(0),)
    deviations: tuple[float, ...] = (1.0,)

    @property
    def order(self) -> int:
        """Number of samples that the noise remembers."""
        return len(self.predictors) - 1

    @property
    def deviation(self) -> float:
        """Standard deviation of the noise [unit of the series]."""
        return self.deviations[0]

    @property
    def innovation_deviation(self) -> float:
        """Standard deviation of the part that the past does not predict [unit of the series]."""
        return self.deviations[-1]

    @property
    def predictable(self) -> float:
        """Share of the variance that the past predicts [1]."""
        return 1.0 - (self.innovation_deviation / self.deviation) ** 2

    @property
    def correlation_time(self) -> float:
        """Number of samples that an independent sample is worth, for the mean of the noise."""
        whole = max(1e-3, 1.0 - float(self.predictors[-1].sum()))
        return float((self.innovation_deviation / whole / self.deviation) ** 2)

    def spectrum(self, frequency: Array, interval: float) -> Array:
        """One-sided power spectral density [units^2/Hz]; interval : between samples [s]."""
        lags = np.arange(1, self.order + 1)
        turns = np.exp(-2j * np.pi * np.outer(frequency, lags) * interval)
        transfer = 1.0 - turns @ self.predictors[-1]
        return np.asarray(2.0 * interval * self.innovation_deviation**2 / np.abs(transfer) ** 2)

    def innovations(self, series: Array, known: NDArray[np.int_]) -> Array:
        """Whitened series: what the past does not predict, over its deviation, shape (n,).

        known : number of samples that precede each one without a break
        """
        left = series / self.innovation_deviation
        if self.order == 0:
            return left
        left[1:] -= np.convolve(left, self.predictors[-1])[: len(series) - 1]
        behind_break = np.flatnonzero(known < self.order)
        used = np.minimum(known[behind_break], SHORT)
        shorter = np.zeros((SHORT + 1, SHORT))
        for m, coefficients in enumerate(self.predictors[: SHORT + 1]):
            shorter[m, :m] = coefficients
        past = series.take(behind_break[:, None] - np.arange(1, SHORT + 1), mode="clip")
        unpredicted = series[behind_break] - np.einsum("ij,ij->i", past, shorter[used])
        left[behind_break] = unpredicted / np.take(self.deviations, used)
        return left


def samples_since_break(time: Array) -> NDArray[np.int_]:
    """Number of samples that precede each one without a hole, shape (n,)."""
    if len(time) == 0:
        return np.zeros(0, int)
    step = np.diff(time, prepend=time[0])
    usual = float(np.median(step[1:])) if len(time) > 1 else 1.0
    place = np.arange(len(time))
    starts = np.where(step > BREAK * usual, place, 0)
    return np.asarray(place - np.maximum.accumulate(starts))


def autocovariance(runs: Sequence[Array], known: Sequence[NDArray[np.int_]], longest: int) -> Array:
    """Autocovariance of unbroken samples of all runs at the lags 0 to `longest`, shape (lags,).

    known : number of samples that precede each one without a break
    """
    found = np.zeros(longest + 1)
    for lag in range(longest + 1):
        products = [
            (v[lag:] * v[: max(0, len(v) - lag)])[k[lag:] >= lag]  # a run may be shorter
            for v, k in zip(runs, known, strict=True)
        ]
        count = sum(map(len, products))
        found[lag] = sum(float(p.sum()) for p in products) / max(1, count)
    # The taper keeps the matrix of the autocovariance positive.
    return found * (1.0 - np.arange(longest + 1) / max(len(v) for v in runs))


def levinson(covariance: Array) -> tuple[list[Array], list[float]]:
    """Predictors of the orders 0, 1, ..., and the variances of their innovations.

    An autocovariance of a series with many breaks need not be that of any process. The recursion
    ends at the order from which on it is not, or predicts nearly all.
    """
    predictors, variances = [np.zeros(0)], [float(covariance[0])]
    for m in range(1, len(covariance)):
        before = predictors[-1]
        missed = covariance[m] - before @ covariance[m - 1 : 0 : -1]
        reflection = float(missed / variances[-1]) if variances[-1] > 0.0 else 1.0
        left = variances[-1] * (1.0 - reflection**2)
        if left < LEAST_LEFT * covariance[0]:
            break
        predictors.append(np.append(before - reflection * before[::-1], reflection))
        variances.append(left)
    return predictors, variances


def fit_autoregression(
    runs: Sequence[Array], times: Sequence[Array], longest: int, price: float, least: float = 0.0
) -> Autoregression:
    """Fit the autoregression of the least criterion n log(variance) + order * price.

    runs, times : residual and time [s] of the samples that count, by run
    longest : highest order; price : of an order, 2 after Akaike and log n after Schwarz
    least : deviation of white noise that is there in any case
    """
    count = sum(map(len, runs))
    known = [samples_since_break(t) for t in times]
    longest = min(longest, max(0, count // 4))
    covariance = autocovariance(runs, known, longest)
    covariance[0] += least**2
    predictors, variances = levinson(covariance)
    criteria = [count * np.log(max(v, 1e-300)) + m * price for m, v in enumerate(variances)]
    order = int(np.argmin(criteria))
    return Autoregression(
        predictors=tuple(predictors[: order + 1]),
        deviations=tuple(np.sqrt(variances[: order + 1]).tolist()),
    )
