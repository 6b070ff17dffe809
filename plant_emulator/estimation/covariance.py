"""Covariance of an estimate, from residuals that need not be white.

With the autocovariance g(k) of each
channel's residual the estimate's covariance is the sandwich

    H^-1 (sum J' G J + P) H^-1,   H = J' J + P,   G[t, s] = g(t - s),   P = prior precision

(Newey and West, Econometrica 55 (1987) 703, for stationary residuals; tapered by a trapezoid,
Politis and Romano, J. Time Series Analysis 16 (1995) 67), enlarged by n/(n - p) for the unknowns
that the residuals have already followed. White residuals of variance 1 give H^-1, as usual.

What it cannot mend: a misfit as slow as the run itself leaves too few independent pieces, and the
errors come out too small; residuals that alternate (lag 1 negative) are taken as white, and the
errors come out too large.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

# Eigenvalue of an information matrix of unit diagonal that is 0 but for rounding [the largest], and
# the part that an unknown has in such a direction.
EIGENVALUE_ROUNDING, LEAST_PART = 1e-14, 1e-6
# Half width of a 95 % confidence interval of a normal distribution [standard errors].
NORMAL_95 = 1.959964


def data_errors(information: Array) -> Array:
    """Standard errors of z, shape (unknowns,), infinite in directions without information.

    information : matrix, shape (unknowns, unknowns)
    """
    scale = np.sqrt(np.diag(information))
    safe = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(safe, safe))
    weight = np.where(values > EIGENVALUE_ROUNDING * values[-1], values, 1e-300)
    variance = (vectors**2 / weight).sum(axis=1) / safe**2
    return np.where(scale > 0.0, np.sqrt(variance), np.inf)


def sandwich(
    residuals: Sequence[Array], jacobians: Sequence[Array], information: Array, precision: Array
) -> Array:
    """The sandwich of the module's text, shape (unknowns, unknowns).

    residuals, jacobians : one a run, (channels, samples) and (channels, samples, unknowns)
    information : J' J; precision : of the priors
    What neither data nor prior know has an infinite variance.
    """
    samples = sum(int(np.count_nonzero(r)) for r in residuals)
    freedom = samples / max(1, samples - len(precision))
    middle = precision.copy()
    for residual, jacobian in zip(residuals, jacobians, strict=True):
        for channel in range(len(residual)):
            slopes = jacobian[channel]
            middle += freedom * slopes.T @ colour(slopes, autocovariance(residual[channel]))
    inverse, unknown = _inverse(information + precision)
    covariance = inverse @ middle @ inverse
    covariance = 0.5 * (covariance + covariance.T)
    # Between the frequencies where it was made positive, the spectrum of a tapered autocovariance
    # may be negative; a variance that comes out so is that of white residuals.
    for k in np.flatnonzero(np.diag(covariance) <= 0.0):
        covariance[k], covariance[:, k] = inverse[k], inverse[k]
    covariance[unknown, unknown] = np.inf
    return np.asarray(covariance)


def white_covariance(information: Array, precision: Array) -> Array:
    """The covariance for white residuals of variance 1, shape (unknowns, unknowns).

    Arguments and infinite variances are those of `sandwich`.
    """
    inverse, unknown = _inverse(information + precision)
    inverse[unknown, unknown] = np.inf
    return inverse


def _inverse(hessian: Array) -> tuple[Array, NDArray[np.int_]]:
    """Inverse of a Hessian where it is known, and the unknowns that have another part."""
    scale = np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    values, vectors = np.linalg.eigh(hessian / np.outer(scale, scale))
    known = values > EIGENVALUE_ROUNDING * values[-1]
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T / np.outer(scale, scale)
    return inverse, np.flatnonzero(np.any(np.abs(vectors[:, ~known]) > LEAST_PART, axis=1))


def autocovariance(residual: Array) -> Array:
    """Autocovariance of a residual at the lags 0, 1, ..., tapered to 0; shape (lags,).

    Lags count in full until the correlation first falls under twice its standard error in white
    noise, and fall off over as many more. Samples of exactly 0 do not count.
    """
    counted = residual != 0.0
    n = int(counted.sum())
    if n < 2:
        return np.zeros(1)
    size = 1 << (2 * len(residual) - 1).bit_length()
    product = np.fft.irfft(np.abs(np.fft.rfft(residual, size)) ** 2, size)
    pairs = np.fft.irfft(np.abs(np.fft.rfft(counted.astype(float), size)) ** 2, size)
    longest = max(1, len(residual) // 4)
    covariance = product[:longest] / np.maximum(np.round(pairs[:longest]), 1.0)
    small = covariance < 2.0 / np.sqrt(n) * covariance[0]
    first = int(np.argmax(small)) if small.any() else longest
    if first <= 1:
        return np.asarray(covariance[:1])
    reach = min(2 * first, longest)
    taper = np.minimum(1.0, 2.0 * (1.0 - np.arange(reach) / reach))
    return _with_spectrum(covariance[:reach] * taper)


def _with_spectrum(covariance: Array) -> Array:
    """The autocovariance with the negative values of its spectrum set to 0."""
    both = np.concatenate([covariance, covariance[:0:-1]])
    spectrum = np.maximum(np.fft.rfft(both).real, 0.0)
    return np.asarray(np.fft.irfft(spectrum, len(both))[: len(covariance)])


def colour(slopes: Array, covariance: Array) -> Array:
    """G J: each column of the Jacobian multiplied by the residual's covariance matrix."""
    if len(covariance) == 1:
        return np.asarray(slopes * covariance[0])
    both = np.concatenate([covariance[:0:-1], covariance])
    whole = len(slopes) + len(both) - 1
    length = 2 ** int(np.ceil(np.log2(whole)))
    spectrum = np.fft.rfft(slopes, length, axis=0) * np.fft.rfft(both, length)[:, None]
    first = len(covariance) - 1
    return np.asarray(np.fft.irfft(spectrum, length, axis=0)[first : first + len(slopes)])


def correlation_time(residual: Array) -> float:
    """Samples that one independent sample is worth: 1 + 2 sum of the correlations, at least 1.

    residual : of one channel, shape (n,)
    """
    covariance = autocovariance(residual)
    if covariance[0] <= 0.0:
        return 1.0
    return max(1.0, float(2.0 * covariance.sum() / covariance[0] - 1.0))


def structure(residual: Array, lags: int = 20) -> float:
    """Ljung-Box excess of a residual: its correlation beyond white noise, in units of chi squared.

    Expected 0 with a standard deviation of sqrt(2 lags) for white noise (Ljung and Box, Biometrika
    65 (1978) 297). Samples of exactly 0 do not count.
    """
    counted = residual[residual != 0.0]
    n = len(counted)
    if n <= lags:
        return 0.0
    centred = counted - counted.mean()
    square = float(centred @ centred)
    if square == 0.0:
        return 0.0
    correlations = [float(centred[k:] @ centred[:-k]) / square for k in range(1, lags + 1)]
    terms = [r**2 / (n - k) for k, r in enumerate(correlations, start=1)]
    return n * (n + 2.0) * sum(terms) - lags
