"""Noise of the motor's balance, as the bench itself shows it, and the alarm level for it (pure).

The drive answers to the noise in the setpoint with a current of which a poll sees one moment a
scan. How large this noise is depends on the bench: on its friction, its gain and its dead time. So
it is measured. What counts for a sum is the variance that a mean keeps when it gets longer, because
the noise changes its sign from scan to scan. Means over two batches in a row show it (method of
batch means), and neither a constant error nor a slow one changes their difference:

    s^2 = n (mean_1 - mean_2)^2 / 2
"""

from dataclasses import dataclass
from math import exp
from statistics import fmean

BATCH, MEMORY = 10, 10.0
"""Windows of a batch, and [s] time constant of the mean of s^2."""
CLIP, CLIPPED = 4.0, 0.9
"""Largest s^2 over its mean that counts, so that a fault or an impact hardly raises the level; and
the mean of normal noise that is left by it: v of E min(z^2, 4 v) = v."""
QUIET, LOUD = 6.0, 60.0
"""[N^2 m^2] Least variance, because a bench that has just set off has not shown its own yet; and
largest, because a sensor that breaks slowly must not teach the level to wait for it."""


@dataclass(frozen=True, kw_only=True)
class BalanceNoise:
    """Variance of a long mean, times its windows [N^2 m^2], and the residuals of two batches."""

    variance: float = QUIET
    recent: tuple[float, ...] = ()


def note(state: BalanceNoise, residual: float, duration: float) -> BalanceNoise:
    """Return the noise after one more window: residual of the balance [N m], duration [s]."""
    recent = (*state.recent, residual)[-2 * BATCH :]
    if len(recent) < 2 * BATCH:
        return BalanceNoise(variance=state.variance, recent=recent)
    between = fmean(recent[BATCH:]) - fmean(recent[:BATCH])
    shown = min(BATCH * between * between / 2.0, CLIP * state.variance)
    variance = shown + (state.variance - shown) * exp(-duration / MEMORY)
    return BalanceNoise(variance=min(max(variance, QUIET), LOUD), recent=recent)


def level(state: BalanceNoise, tolerance: float, duration: float, rarity: float) -> float:
    """Alarm level of a sum of this noise, see `walk` [N m s]."""
    return walk(state.variance / CLIPPED, tolerance, duration, rarity)


def walk(variance: float, tolerance: float, duration: float, rarity: float) -> float:
    """Level that a sum of noise passes with probability exp(-rarity) [unit of the noise times s].

    P(S > h) = exp(-2 k h / (s^2 dt)) for increments of mean -k dt and variance (s dt)^2: the
    largest value of a random walk (E. S. Page, Biometrika 41 (1954) 100).

    variance, tolerance : s^2 and k of a window; duration : dt of a window [s]
    """
    return rarity * variance * duration / (2.0 * tolerance)
