"""Sums over a run drawn anew in blocks of time, for intervals that allow for the residual's memory.

Each block starts anywhere, goes on at the run's beginning where it passes the end, and the last one
is cut so that a draw is as long as the run: the circular block bootstrap (D. N. Politis, J. P.
Romano, in LePage, Billard (ed.), Exploring the Limits of Bootstrap, Wiley 1992, 263).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.covariance import correlation_time

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

# A block in memories of the squares.
MEMORIES = 3.0
FEWEST, MOST = 10, 500
"""Blocks of a run."""
DRAWS = 400
SEED = 1


def block_length(residual: Array) -> int:
    """Samples of a block for a run of this residual, shape (channels, samples).

    What is drawn is a mean of squares, so that the memory that counts is the one of the squares
    about their mean: an offset lengthens no block. A block has MEMORIES of it, which leaves out a
    sixth of the variance of such a mean at most (first-order residuals), and at most 1/FEWEST of
    the run: of m blocks the interval's width is known to 1/sqrt(2 m), a fifth at ten; of fewer it
    is a guess. Of runs of a thousand samples the usual bound, 3 sqrt(n), is the same (D. N.
    Politis, H. White, Econometric Reviews 23 (2004) 53). More than MOST blocks would not be
    better, only slower.
    """
    samples = residual.shape[1]
    wanted = MEMORIES * max(correlation_time(_squares(channel)) for channel in residual)
    return max(1, round(float(np.clip(wanted, samples / MOST, samples / FEWEST))))


def _squares(channel: Array) -> Array:
    """Squares of a residual about their mean; 0 where a sample does not count."""
    counted = channel != 0.0
    if not counted.any():
        return np.zeros(len(channel))
    return np.where(counted, channel**2 - np.mean(channel[counted] ** 2), 0.0)


def sums(runs: Sequence[Array], lengths: Sequence[int]) -> Array:
    """Sums over time of DRAWS draws of all runs, shape (channels, DRAWS).

    runs : shape (channels, samples) each; lengths : of each run's blocks
    The same for all runs of the same length and blocks, so that what is drawn can be compared.
    """
    random = np.random.default_rng(SEED)
    return np.asarray(
        sum(_sums(run, length, random) for run, length in zip(runs, lengths, strict=True))
    )


def _sums(run: Array, length: int, random: np.random.Generator) -> Array:
    samples = run.shape[1]
    begins = np.arange(0, samples, length)
    sizes = np.minimum(length, samples - begins)
    starts = random.integers(0, samples, size=(DRAWS, len(begins)))
    until = np.cumsum(np.concatenate([np.zeros((len(run), 1)), run, run], axis=1), axis=1)
    return np.asarray((until[:, starts + sizes] - until[:, starts]).sum(axis=2))
