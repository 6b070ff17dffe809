"""The noise of all channels of several runs, from what a model leaves of them (pure)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.nearby import Changed
from plant_emulator.estimation.noise.channel_noise import ChannelNoise, Whitener
from plant_emulator.estimation.noise.disturbances import outlying
from plant_emulator.estimation.noise.estimate import estimate_channel_noise
from plant_emulator.signals.mains import lines_in_differences

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.signals.log import Array
    from plant_emulator.signals.noise import NoiseSeries

# Deviations up to this much off the declared one are the declared one's own error [1].
KNOWN = 0.03
# Share of the samples up to which outliers are faults of a transmission, not a machine that shakes.
MOST_OUTLIERS = 0.02


@dataclass(frozen=True)
class LoggedNoise:
    """The noise of every channel by name, and the whiteners by run in the channels' order."""

    channels: Mapping[str, ChannelNoise]
    whiteners: Mapping[int, tuple[Whitener, ...]]

    @property
    def plain(self) -> bool:
        """Whether the noise is white and as large as declared."""
        return all(
            c.colour.order == 0
            and not c.lines
            and c.outliers == 0.0
            and abs(c.deviation - 1.0) < KNOWN
            for c in self.channels.values()
        )

    def resembles(self, other: LoggedNoise) -> bool:
        """Whether two models of the noise of the same channels are as good as the same."""
        return all(
            abs(np.log(a.colour.innovation_deviation / b.colour.innovation_deviation)) < KNOWN
            and abs(np.log(a.deviation / b.deviation)) < 2.0 * KNOWN
            and _same_lines(a.lines, b.lines)
            for a, b in ((one, other.channels[name]) for name, one in self.channels.items())
        )

    def with_outliers_of(self, other: LoggedNoise) -> LoggedNoise:
        """This noise, with the outliers of another noise of the same runs left out as well."""
        channels = {
            name: replace(one, outliers=one.outliers + other.channels[name].outliers)
            for name, one in self.channels.items()
        }
        whiteners = {
            run: tuple(
                replace(one, use=one.use & more.use)
                for one, more in zip(own, other.whiteners[run], strict=True)
            )
            for run, own in self.whiteners.items()
        }
        return LoggedNoise(channels=channels, whiteners=whiteners)

    def whitened(self, run: int, residual: Residual) -> Residual:
        """The residual function of a run, whitened for this noise."""
        whiteners = self.whiteners[run]

        def white(rows: Array) -> Array:
            return np.stack([w.white(row) for w, row in zip(whiteners, rows, strict=True)])

        return Changed(residual, white)


def _same_lines(first: Sequence[float], second: Sequence[float]) -> bool:
    """Whether two noises have the same lines, each within what a run of a minute tells apart."""
    return len(first) == len(second) and bool(np.allclose(first, second, rtol=0.0, atol=0.02))


def noise_of_runs(series: Iterable[tuple[int, str, NoiseSeries]]) -> LoggedNoise:
    """Estimate the noise of each channel from its residuals in all runs together.

    series : run, channel and residual, for every channel of every run, in the channels' order
    """
    return _by_channel(estimate_channel_noise, series)


def disturbances_of_runs(
    series: Iterable[tuple[int, str, NoiseSeries]], *, marked: bool = True
) -> LoggedNoise | None:
    """Find the lines of each channel, and mark its outliers; None where there is neither.

    They show beside any misfit of a model, and before anything is known of its cause. All else is
    the noise as declared.

    series : see `noise_of_runs`; marked : whether outliers are left out
    """
    found = _by_channel(partial(_disturbances, marked=marked), series)
    disturbed = any(c.lines or c.outliers for c in found.channels.values())
    return found if disturbed else None


def _disturbances(
    series: Sequence[NoiseSeries], *, marked: bool
) -> tuple[ChannelNoise, list[Whitener]]:
    """Declared noise of a channel beside lines and outliers, and each run's whitener."""
    uses, share = [s.use for s in series], 0.0
    if marked:
        kept = [s.use & ~outlying(s.value, s.use) for s in series]
        counted = sum(int(use.sum()) for use in uses)
        share = 1.0 - sum(int(use.sum()) for use in kept) / max(1, counted)
        uses, share = (kept, share) if share <= MOST_OUTLIERS else (uses, 0.0)
    lines, _ = lines_in_differences(series, uses)
    told = tuple(sorted(f for own in lines for f in own))
    noise = ChannelNoise(lines=told, outliers=share)
    return noise, [
        Whitener(noise, use, s.time, own) for s, use, own in zip(series, uses, lines, strict=True)
    ]


def _by_channel(
    estimate: Callable[[Sequence[NoiseSeries]], tuple[ChannelNoise, list[Whitener]]],
    series: Iterable[tuple[int, str, NoiseSeries]],
) -> LoggedNoise:
    """Estimate the noise of each channel from its residuals in all runs together."""
    given = list(series)
    channels: dict[str, ChannelNoise] = {}
    found: dict[tuple[int, str], Whitener] = {}
    for name in dict.fromkeys(name for _, name, _ in given):
        pairs = [(k, one) for k, other, one in given if other == name]
        channels[name], whiteners = estimate([one for _, one in pairs])
        found |= {(k, name): one for (k, _), one in zip(pairs, whiteners, strict=True)}
    runs = dict.fromkeys(k for k, _, _ in given)
    ordered = {k: tuple(found[k, name] for other, name, _ in given if other == k) for k in runs}
    return LoggedNoise(channels, ordered)
