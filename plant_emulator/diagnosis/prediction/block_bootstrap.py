"""The circular block bootstrap: sums over runs that are drawn anew in blocks of time.

Intervals from such draws allow for the autocorrelation of the residual. A block starts at any
sample, and continues at the beginning of the run where it passes the end. The last block is cut, so
that a draw is as long as the run (D. N. Politis, J. P. Romano, in LePage, Billard (ed.), Exploring
the Limits of Bootstrap, Wiley 1992, 263).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.covariance import correlation_time

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

# Length of a block in correlation times of the squares.
CORRELATION_TIMES = 3.0
# Blocks of a run.
FEWEST_BLOCKS, MOST_BLOCKS = 10, 500
BOOTSTRAP_DRAWS = 400
SEED = 1


def block_length(residual: Array) -> int:
    """Samples of a block for a run with this residual, shape (channels, samples).

    A draw estimates a mean of squares, so the correlation time of the squares about their mean
    counts; an offset lengthens no block. A block of CORRELATION_TIMES leaves out at most a sixth of
    the variance of such a mean (first-order residuals). A run has at least FEWEST_BLOCKS: m blocks
    give the interval's width to 1/sqrt(2 m), which is a fifth at ten blocks. For runs of a thousand
    samples the usual bound, 3 sqrt(n), is the same (D. N. Politis, H. White, Econometric Reviews 23
    (2004) 53). More than MOST_BLOCKS would only take longer.
    """
    samples = residual.shape[1]
    wanted = CORRELATION_TIMES * max(correlation_time(_squares(channel)) for channel in residual)
    shortest, longest = samples / MOST_BLOCKS, samples / FEWEST_BLOCKS
    return max(1, round(float(np.clip(wanted, shortest, longest))))


def _squares(channel: Array) -> Array:
    """Squares of a residual about their mean; 0 where a sample does not count."""
    counted = channel != 0.0
    if not counted.any():
        return np.zeros(len(channel))
    return np.where(counted, channel**2 - np.mean(channel[counted] ** 2), 0.0)


def resampled_sums(runs: Sequence[Array], lengths: Sequence[int]) -> Array:
    """Sums over time of draws of all runs together, shape (channels, BOOTSTRAP_DRAWS).

    runs : shape (channels, samples) each; lengths : samples of a block of each run
    Runs of equal length and blocks are drawn alike, so that two hypotheses can be compared.
    """
    random = np.random.default_rng(SEED)
    return np.asarray(
        sum(_sums(run, length, random) for run, length in zip(runs, lengths, strict=True))
    )


def _sums(run: Array, length: int, random: np.random.Generator) -> Array:
    samples = run.shape[1]
    begins = np.arange(0, samples, length)
    sizes = np.minimum(length, samples - begins)
    starts = random.integers(0, samples, size=(BOOTSTRAP_DRAWS, len(begins)))
    until = np.cumsum(np.concatenate([np.zeros((len(run), 1)), run, run], axis=1), axis=1)
    return np.asarray((until[:, starts + sizes] - until[:, starts]).sum(axis=2))
