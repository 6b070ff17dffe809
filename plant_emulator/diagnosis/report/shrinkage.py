"""The shrinkage of the held-out gap, by channel and by effect."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import HeldOutGap
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.prediction.gap import (
    closed_fraction,
    closed_fraction_interval,
    combined_gap,
)
from plant_emulator.diagnosis.prediction.held_out import NOMINAL
from plant_emulator.diagnosis.report.details import Step

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.machine import MeasuredRun
    from plant_emulator.diagnosis.prediction.gap import Gap
    from plant_emulator.signals.log import Array

    # By the effects of a model, or NOMINAL: what it leaves on the held-out runs.
    Gaps = Mapping[tuple[str, ...], Gap]


def held_out_gap(
    gaps: Gaps,
    runs: Sequence[MeasuredRun],
    effects: tuple[str, ...],
    reference: Gap | None,
    fitted: Gap | None = None,
) -> HeldOutGap:
    """The gap of every channel with these effects, and the share that they close.

    runs : the held-out runs behind the gaps
    reference : the gap that is to be closed; None: no share is told
    fitted : gap that the fit to all runs leaves; the predictions belong to fits to fewer runs, so
        that the interval of the share reaches from the low end of theirs to the high end of its own
    """
    explained = gaps[effects]
    return HeldOutGap(
        nominal=nrmsd(gaps[NOMINAL], runs),
        recalibrated=nrmsd(gaps[()], runs),
        explained=nrmsd(explained, runs),
        noise_floor=noise_floor(gaps[()], runs),
        closed_fraction=None if reference is None else closed_fraction(reference, explained),
        closed_fraction_ci95=None if reference is None else _interval(reference, explained, fitted),
    )


def _interval(reference: Gap, explained: Gap, fitted: Gap | None) -> tuple[float, float] | None:
    """95 % interval of the closed fraction of the fit to all runs [1].

    What that fit leaves may be noise up to NOISE_MEAN_SQUARE.
    """
    interval = closed_fraction_interval(reference, explained)
    if interval is None or fitted is None:
        return interval
    most = closed_fraction_interval(reference, fitted, NOISE_MEAN_SQUARE)
    return None if most is None else (interval[0], max(interval[1], most[1]))


def nrmsd(gap: Gap, runs: Sequence[MeasuredRun]) -> dict[str, float]:
    """NRMSD of every channel [1]: its rms over its measured range, held-out samples of all runs."""
    return dict(zip(gap.channels, _shares(gap, runs, gap.by_channel), strict=True))


def noise_floor(gap: Gap, runs: Sequence[MeasuredRun]) -> dict[str, float]:
    """The noise of every channel over its measured range [1], as `nrmsd`."""
    return dict(zip(gap.channels, _shares(gap, runs, np.ones(len(gap.channels))), strict=True))


def _shares(gap: Gap, runs: Sequence[MeasuredRun], times: Array) -> list[float]:
    """Multiples of each channel's noise over the measured range of the channel [1]."""
    found = []
    for k, name in enumerate(gap.channels):
        own = [(r, w) for r, w in zip(runs, gap.weights, strict=True) if name in r.channels]
        counted = [run.measured[run.channels.index(name)][w[k] > 0.0] for run, w in own]
        found.append(float(times[k] * gap.noise[k] / np.ptp(np.concatenate(counted))))
    return found


def waterfall(gaps: Mapping[tuple[str, ...], Gap], accepted: Sequence[str]) -> tuple[Step, ...]:
    """The held-out gap as given, recalibrated, and with every accepted effect added in turn."""
    labels = {NOMINAL: "parameter set as given", (): "recalibrated"}
    labels |= {
        tuple(accepted[: k + 1]): f"with {name}" if k == 0 else f"and {name}"
        for k, name in enumerate(accepted)
    }
    steps = []
    for key, label in labels.items():
        value, low, high = combined_gap(gaps[key])
        steps.append(Step(label=label, gap=value, low=low, high=high))
    return (*steps, Step(label="noise floor", gap=1.0, low=1.0, high=1.0))
