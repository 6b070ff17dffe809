"""Estimate of the noise of a channel from the residuals that a rich model leaves (pure).

Noise is there all the time, a cause is not. The autoregression is therefore fitted to the blocks
whose innovations are as small as those of the quiet blocks, and the fit is repeated. What the other
blocks hold stays for the effects to explain. The order follows from Schwarz's criterion, or from
Akaike's with a longer memory where Schwarz's leaves coloured innovations.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.noise.autoregression import Autoregression, fit_autoregression
from plant_emulator.estimation.noise.channel_noise import (
    COLOURED,
    ChannelNoise,
    Whitener,
    ljung_box_excess,
)
from plant_emulator.estimation.noise.disturbances import outlying
from plant_emulator.signals.mains import EVIDENCE, likely_lines, subtract_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array
    from plant_emulator.signals.noise import NoiseSeries

    Uses = Sequence[NDArray[np.bool_]]
    # Frequencies of the lines of each run [Hz].
    Lines = Sequence[tuple[float, ...]]

# Memory of the noise [samples]: 0.3 s of correlation at 100 Hz is told by 12 poles, and slow wander
# beside white noise by 60.
ORDER, LONG_ORDER = 12, 60
# Samples of a block, and its mean square over that of the quiet blocks from which on it holds more
# than noise: five standard deviations of the mean of so many squares.
BLOCK, LOUD = 50, 2.0
# The quiet blocks: this quantile of the blocks' mean squares, and its value for white noise.
QUIET, QUIET_SQUARE = 0.25, 0.86
# Deviation of the white noise that there is in any case, in the declared noise: a coarse channel
# that stands still shows none. A block that shows less says nothing of the noise.
LEAST = 0.1
# Times that the quiet blocks are looked for; the last time changed them little.
PASSES = 4


def estimate_channel_noise(
    series: Sequence[NoiseSeries], *, disturbed: bool = True
) -> tuple[ChannelNoise, list[Whitener]]:
    """Estimate the noise that these residuals of a channel show; give each run's whitener too.

    disturbed : whether outliers and lines are looked for as well
    """
    uses: list[NDArray[np.bool_]] = [s.use for s in series]
    noise = ChannelNoise()
    if disturbed:
        uses = [s.use & ~outlying(s.value, s.use) for s in series]
        counted = sum(int(s.use.sum()) for s in series)
        left_out = 1.0 - sum(int(u.sum()) for u in uses) / max(1, counted)
        noise = ChannelNoise(outliers=left_out)
    lines: Lines = [() for _ in series]
    noise = _fit_colour(noise, series, uses, lines, ORDER)
    if disturbed:
        noise, lines = _with_lines(noise, series, uses)
    found = _whiteners(noise, series, uses, lines)
    if found[0].noise.ljung_box_excess > COLOURED:
        # Few quiet blocks say little of long lags: the innovations tell which memory is right.
        longer = _fit_colour(noise, series, uses, lines, LONG_ORDER)
        other = _whiteners(longer, series, uses, lines)
        found = min(found, other, key=lambda one: one[0].noise.ljung_box_excess)
    return found[0].noise, found


def _whiteners(
    noise: ChannelNoise, series: Sequence[NoiseSeries], uses: Uses, lines: Lines
) -> list[Whitener]:
    """Whiteners of all runs, their noise with the result of its tests."""
    found = [Whitener(noise, u, s.time, own) for s, u, own in zip(series, uses, lines, strict=True)]
    left = [w.white(s.value) for w, s in zip(found, series, strict=True)]
    squares, _ = _block_squares(left, uses)
    tested = replace(
        noise,
        disturbance=_disturbance(series, uses, lines),
        ljung_box_excess=ljung_box_excess([v[u] for v, u in zip(left, uses, strict=True)]),
        unsteady=float(np.mean(np.concatenate(squares) > LOUD)),
    )
    return [replace(w, noise=tested) for w in found]


def _disturbance(series: Sequence[NoiseSeries], uses: Uses, lines: Lines) -> float:
    """Mean square of the lines over the samples that count."""
    parts = [
        (s.value - subtract_lines(s, use, own))[use] ** 2
        for s, use, own in zip(series, uses, lines, strict=True)
    ]
    return float(np.mean(np.concatenate(parts)))


def _with_lines(
    noise: ChannelNoise, series: Sequence[NoiseSeries], uses: Uses
) -> tuple[ChannelNoise, Lines]:
    """The noise with the lines of each run, where they shrink the innovations."""
    none: Lines = [() for _ in series]
    lines = likely_lines(series, uses, lambda _: noise.deviation)
    told = tuple(sorted(f for own in lines for f in own))
    if not told:
        return noise, none
    found = _fit_colour(replace(noise, lines=told), series, uses, lines, ORDER)
    count = sum(int(u.sum()) for u in uses)
    shrunk = noise.colour.innovation_deviation / found.colour.innovation_deviation
    if count * np.log(shrunk) > EVIDENCE + 4.0 * len(series):
        return found, lines
    return noise, none


def _fit_colour(
    noise: ChannelNoise, series: Sequence[NoiseSeries], uses: Uses, lines: Lines, longest: int
) -> ChannelNoise:
    """The noise with the autoregression of its quiet blocks; longest : memory [samples]."""
    values = [subtract_lines(s, use, own) for s, use, own in zip(series, uses, lines, strict=True)]
    # From white noise on: an autoregression that was fitted to a cause would predict the cause.
    found = Autoregression()
    for _ in range(PASSES):
        kept = _mark_quiet(found, series, values, uses)
        found = _autoregression(series, values, kept, longest)
    return replace(noise, colour=found)


def _autoregression(
    series: Sequence[NoiseSeries], values: Sequence[Array], uses: Uses, longest: int
) -> Autoregression:
    """Autoregression of the samples that count."""
    runs = [v[use] for v, use in zip(values, uses, strict=True)]
    times = [s.time[use] for s, use in zip(series, uses, strict=True)]
    price = float(np.log(max(3, sum(map(len, runs))))) if longest == ORDER else 2.0
    return fit_autoregression(runs, times, longest, price, LEAST)


def _mark_quiet(
    colour: Autoregression, series: Sequence[NoiseSeries], values: Sequence[Array], uses: Uses
) -> list[NDArray[np.bool_]]:
    """Samples of the blocks whose innovations are as small as those of the quiet blocks."""
    plain = ChannelNoise(colour=colour)
    left = [
        Whitener(plain, use, s.time).innovations(v)
        for s, v, use in zip(series, values, uses, strict=True)
    ]
    squares, blocks = _block_squares(left, uses)
    least = (LEAST / colour.innovation_deviation) ** 2
    alive = np.concatenate(squares)
    alive = alive[alive > least]
    if len(alive) == 0:
        return list(uses)
    level = float(np.quantile(alive, QUIET)) / QUIET_SQUARE
    return [
        use & ((square > least) & (square <= LOUD * level))[block]
        for use, square, block in zip(uses, squares, blocks, strict=True)
    ]


def _block_squares(left: Sequence[Array], uses: Uses) -> tuple[list[Array], list[NDArray[np.int_]]]:
    """Mean square of each block of innovations, and the block of each sample, by run."""
    squares, blocks = [], []
    for v, use in zip(left, uses, strict=True):
        block = (np.cumsum(use) - 1).clip(0) // BLOCK
        count = np.maximum(1.0, np.bincount(block[use], minlength=block.max() + 1))
        squares.append(np.bincount(block[use], v[use] ** 2, block.max() + 1) / count)
        blocks.append(block)
    return squares, blocks
