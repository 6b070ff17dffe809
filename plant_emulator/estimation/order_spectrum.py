"""Order analysis: what a residual repeats with the angle of a turning part (pure).

    S(o) = |sum_k r_k exp(-2 pi i o n_k)|^2 / sum_k r_k^2

r : whitened residual; n : turns of the part; o : order, waves a turn. A wheel, a shaft or a tooth
leaves one order at every speed (A. Brandt, Noise and Vibration Analysis (2011), chapter 12). In
white noise S is exponential with mean 1. Noise that is not quite white makes waves of time, and at
a constant speed each of them is also an order, of which drift is one. An order is a ripple only if
it holds clearly more than any wave of time does; a log at one speed tells no ripple.

The samples are laid on an even grid, each on its two neighbours, so that one Fourier transform
gives all orders. At rest all samples lie at one angle; they are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

# Probability that white noise in one channel shows a ripple: one in a million.
CHANCE = 1e-6
# Squares of a ripple over those of the strongest wave of time. Drift in a cruise came to 1.0; the
# ripples of the blind trials hold four times as much and more.
OVER_TIME = 2.0
# Share of the largest speed below which the part is at rest.
REST = 0.02
# Cells of the grid in a wave of the highest order: a wave on both neighbours keeps 90 % of S.
CELLS_OF_A_WAVE = 8
# Padding with zeros: between two orders of the grid a fifth of a line's power is lost at worst.
PADDING = 2


@dataclass(frozen=True, kw_only=True)
class TurningRun:
    """What a channel leaves in one run, at the samples that count, shape (n,) each.

    time : [s]; turns : angle of the turning part [turns]; residual : whitened [1]
    """

    time: Array
    turns: Array
    residual: Array

    def moving(self) -> TurningRun:
        """The samples at which the part turns."""
        if len(self.time) < 2:
            return self
        speed = np.abs(np.gradient(self.turns, self.time))
        turning = speed > REST * speed.max()
        return TurningRun(
            time=self.time[turning] - self.time[0],
            turns=self.turns[turning] - self.turns.min(),
            residual=self.residual[turning],
        )


@dataclass(frozen=True, kw_only=True)
class Ripple:
    """The strongest order of a residual.

    order : waves a turn [1]
    squares : of the residual that the order holds in all runs [chi squared]
    by_noise : squares that noise reaches: white noise with the probability CHANCE, other noise by
        its waves of time
    """

    order: float
    squares: float
    by_noise: float


def strongest_ripple(runs: Sequence[TurningRun], lowest: float, highest: float) -> Ripple | None:
    """Find the strongest order of a channel in all runs together, each with a phase of its own.

    lowest, highest : orders between which it is looked for [1]
    None: no run turns so far that the lowest order would repeat
    """
    from scipy.special import gammainccinv

    moving = [one for one in (run.moving() for run in runs) if _repeats(one, lowest)]
    if not moving:
        return None
    residuals = [one.residual for one in moving]
    orders, power = _spectrum([one.turns for one in moving], residuals, highest)
    wanted = (orders >= lowest) & (orders <= highest)
    best = int(np.argmax(np.where(wanted, power, 0.0)))
    interval = min(float(np.median(np.diff(one.time))) for one in moving)
    _, waves = _spectrum([one.time for one in moving], residuals, 0.5 / interval)
    trials = PADDING * max(float(one.turns.max()) for one in moving) * (highest - lowest)
    white = gammainccinv(len(moving), CHANCE / trials)
    return Ripple(
        order=float(orders[best]),
        squares=2.0 * float(power[best]),
        by_noise=2.0 * max(float(white), OVER_TIME * float(waves.max())),
    )


def _repeats(run: TurningRun, lowest: float) -> bool:
    return bool(run.residual.any()) and float(np.ptp(run.turns)) * lowest > 1.0


def _spectrum(
    places: Sequence[Array], residuals: Sequence[Array], highest: float
) -> tuple[Array, Array]:
    """Waves in a unit of the places, up to the highest and beyond, and the sum of S of all runs."""
    cell = 1.0 / (CELLS_OF_A_WAVE * highest)
    longest = max(float(place.max()) for place in places)
    count = 1 << int(np.ceil(np.log2(PADDING * longest / cell + 2.0)))
    power = [_power(p / cell, r, count) for p, r in zip(places, residuals, strict=True)]
    return np.arange(count // 2 + 1) / (count * cell), np.sum(power, axis=0)


def _power(place: Array, residual: Array, count: int) -> Array:
    """S at all orders; place : of each sample on the grid [cells]."""
    before = place.astype(int)
    share = place - before
    grid = np.bincount(before, (1.0 - share) * residual, count)
    grid += np.bincount(before + 1, share * residual, count)
    return np.asarray(np.abs(np.fft.rfft(grid)) ** 2 / np.sum(residual**2))
