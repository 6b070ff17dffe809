"""The noise that the rows of the relations show themselves, where it is not as declared.

Colour, hum and outliers of a log are in every relation that the channel enters. Each relation, and
the drum speed, counts as a channel of its own: its noise is estimated on what the best law leaves,
and a law is then judged in rows that are white. What no sensor has is no noise but a gap that the
law does not close: such rows stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.parity_relations import ROWS
from plant_emulator.estimation.noise.channel_noise import ChannelNoise, Whitener
from plant_emulator.estimation.noise.estimate import estimate_channel_noise
from plant_emulator.signals.noise import NoiseSeries

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
    from plant_emulator.signals.log import Array


@dataclass(frozen=True)
class RowNoise:
    """The whiteners of every run, each with the rows that it makes white."""

    whiteners: Sequence[Sequence[tuple[slice, Whitener]]]

    def white(self, run: int, rows: Array) -> Array:
        """Rows of a run in their own noise, shape (n, k)."""
        found = np.zeros_like(rows)
        for place, whitener in self.whiteners[run]:
            own = rows[place]
            shown = own.any(axis=0)
            if shown.any():
                columns = [whitener.white(column) for column in own[:, shown].T]
                found[place, shown] = np.stack(columns, axis=-1)
        return found


def row_noise(regression: BlockRegression, rest: Sequence[Array]) -> RowNoise:
    """Estimate the noise of the rows; rest : what the best law leaves of those of each run."""
    found: list[list[tuple[slice, Whitener]]] = [[] for _ in rest]
    for kind in (*range(ROWS), None):
        runs, places, series = [], [], []
        for k, (relation, m) in enumerate(
            zip(regression.relations, regression.signals, strict=True)
        ):
            count = len(relation.value)
            place = slice(relation.value.size, None)
            if kind is not None:
                place = slice(kind, relation.value.size, count)
            if kind is None or kind < count:
                value = rest[k][place]
                time = m.time if kind is None else m.time[1:]
                runs.append(k)
                places.append(place)
                series.append(NoiseSeries(time=time, value=value, use=value != 0.0))
        if any(one.use.any() for one in series):
            noise, whiteners = estimate_channel_noise(series)
            if not noise.of_sensor:
                whiteners = [Whitener(ChannelNoise(), one.use, one.time) for one in series]
            for k, place, own in zip(runs, places, whiteners, strict=True):
                found[k].append((place, own))
    return RowNoise(found)
