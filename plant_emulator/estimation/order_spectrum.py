"""Order analysis: what a residual repeats with the angle of a turning part (pure).

    S(o) = |sum_k r_k exp(-2 pi i o n_k)|^2 / sum_k r_k^2

r : whitened residual; n : turns of the part; o : order, waves a turn. A wheel, a shaft or a tooth
leaves one order at every speed, and no noise of a sensor does (A. Brandt, Noise and Vibration
Analysis (2011), chapter 12). In white noise S is exponential with mean 1, whatever the turns.

The samples are laid on an even grid of turns, each on its two neighbours, so that one Fourier
transform gives all orders.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

# Probability that noise shows a ripple, in one diagnosis: one in a million.
CHANCE = 1e-6
# Cells of the grid in a wave of the highest order: a wave on both neighbours keeps 97 % of S.
CELLS_OF_A_WAVE = 8
# Padding of the turns with zeros: at worst a quarter of a line's power is lost between two orders.
PADDING = 2


@dataclass(frozen=True, kw_only=True)
class Ripple:
    """The strongest order of a residual.

    order : waves a turn [1]
    squares : of the residual that the order holds in all runs [chi squared]
    by_chance : squares that the strongest order of noise reaches with the probability CHANCE
    """

    order: float
    squares: float
    by_chance: float

    @property
    def significant(self) -> bool:
        """Whether chance does not explain the order."""
        return self.squares > self.by_chance


def strongest_ripple(
    runs: Sequence[tuple[Array, Array]], lowest: float, highest: float
) -> Ripple | None:
    """Find the strongest order of a channel in all runs together, each with a phase of its own.

    runs : turns and residual of the samples that count, shape (n,) each
    lowest, highest : orders between which it is looked for [1]
    None: no run turns so far that the lowest order would repeat
    """
    from scipy.special import gammainccinv

    pairs = [
        (n - n.min(), r) for n, r in runs if len(n) > 0 and r.any() and np.ptp(n) * lowest > 1.0
    ]
    if not pairs:
        return None
    longest = max(float(n.max()) for n, _ in pairs)
    cell = 1.0 / (CELLS_OF_A_WAVE * highest)
    count = 1 << int(np.ceil(np.log2(PADDING * longest / cell)))
    orders = np.arange(count // 2 + 1) / (count * cell)
    power = np.sum([_power(n / cell, r, count) for n, r in pairs], axis=0)
    wanted = (orders >= lowest) & (orders <= highest)
    best = int(np.argmax(np.where(wanted, power, 0.0)))
    trials = PADDING * longest * (highest - lowest)
    return Ripple(
        order=float(orders[best]),
        squares=2.0 * float(power[best]),
        by_chance=2.0 * float(gammainccinv(len(pairs), CHANCE / trials)),
    )


def _power(place: Array, residual: Array, count: int) -> Array:
    """S at all orders; place : of each sample on the grid [cells]."""
    before = place.astype(int)
    share = place - before
    grid = np.bincount(before, (1.0 - share) * residual, count)
    grid += np.bincount(before + 1, share * residual, count)
    return np.asarray(np.abs(np.fft.rfft(grid)) ** 2 / np.sum(residual**2))
