"""Ways to the data: where a joint fit may begin.

Far from the data a free simulation has one local minimum for every way in which contact may come
and go. A fit is led along the measured outputs first (`lead`), and then left to run freely for
longer and longer times (`let_go`): a homotopy from prediction errors to simulation errors. White
noise leads nothing, so that both are the same at the right values.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fit_result import FitResult, FitValues
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import (
    charged,
    fit,
    joint_unknowns,
    to_result,
    with_starts,
)
from plant_emulator.diagnosis.settings import SETTINGS
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE, estimate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.machine import Model

# Relative fall of the cost that ends a fit along the measured outputs: it is a start only.
LED_COST_TOLERANCE = 1e-3
# Share of what a fit along the measured outputs left before, up to which another one leads nearer
# to the data. It left up to 0.74 where contact had come at the wrong time, and 0.98 where a cause
# was missing. A needless approach costs time only.
NEARER_SHARE = 0.9
# Times between the corrections that lead a simulation along the measured outputs [s]: in the first
# a speed that is off by some percent crosses a tenth of the backlash, in the third most of it. Each
# is some 2.5 times the one before: jumps of five ended in local minima where the drum rocks to and
# fro in the backlash.
CORRECTION_INTERVALS = (0.2, 0.5, 1.2, 3.0, 8.0)


def nearest(
    model: Model,
    starts: Sequence[FitValues],
    runs: Sequence[int],
    far: float = SUSPECT_MEAN_SQUARE,
) -> FitValues | None:
    """The start that leaves least, all with the same effects; None where it is far from the data.

    far : mean square above which a start is far
    """
    squares = [mean_square(model, one, runs) for one in starts]
    return starts[int(np.argmin(squares))] if min(squares) <= far else None


def let_go(
    model: Model, led: FitValues, runs: Sequence[int], iterations: int = SETTINGS.leader_iterations
) -> FitValues:
    """A fit along the measured outputs, left to run freely for longer and longer times.

    It ends where its values already leave nothing but noise when they run freely.
    """
    for interval in CORRECTION_INTERVALS[1:]:
        if mean_square(model, led, runs) <= NOISE_MEAN_SQUARE:
            break
        led = lead(model, led, runs, interval, iterations)
    return led


def mean_square(model: Model, start: FitValues, runs: Sequence[int]) -> float:
    """Mean square of the whitened residual at a start."""
    rows = [
        model.residual(k, start.effects)({**start.values, **own})
        for k, own in zip(runs, start.states, strict=True)
    ]
    return sum(float(np.sum(r**2)) for r in rows) / sum(np.count_nonzero(r) for r in rows)


def lead(
    model: Model,
    start: FitValues,
    runs: Sequence[int],
    interval: float = CORRECTION_INTERVALS[0],
    iterations: int = SETTINGS.leader_iterations,
) -> FitResult:
    """Fit by a simulation that is led along the measured outputs; see `Model.observer`.

    Its first slopes are its own, and no secants follow them: with the steps of another fit, a bench
    near the limit of its voltage ended at thirty times its noise.
    """
    unknowns = with_starts(joint_unknowns(model, start.effects, runs), start.values, start.states)
    observer = model.observer(interval)
    found = estimate(
        unknowns,
        [observer.residual(k, start.effects) for k in runs],
        settled=LED_COST_TOLERANCE,
        iterations=iterations,
        rough=True,
    )
    return to_result(start.effects, found, len(runs), charged(model, start.effects))


def fit_null(model: Model, runs: Sequence[int]) -> FitResult:
    """Fit without effects from the model's own start values; see `approach_null`."""
    return approach_null(model, runs)[0]


def approach_null(model: Model, runs: Sequence[int]) -> tuple[FitResult, FitResult | None]:
    """Fit without effects from the model's own start values; give the best led fit as well.

    A fit that ends far from the data may have taken contact at the wrong time once. It is led along
    the measured outputs again, and let go if that leads nearer: a bench near the limit of its
    voltage had ended at 32 times the noise (see the tests). A fit that is led to where it was
    before lacks a cause. Far from the data a free fit has bent the parameters, some up to their
    bounds, so that the model's own start may lead to less than the fit does.

    The led fit is None where the fit ends near the data: it leads there itself.
    """
    values, states = model.start_values(runs)
    start = FitValues(effects=(), values=values, states=tuple(states))
    near = nearest(model, [start], runs)
    if near is not None:
        return _fit_without_effects(model, near, runs), None
    first = lead(model, start, runs)
    found = _fit_without_effects(model, let_go(model, first, runs), runs)
    if found.mean_square <= SUSPECT_MEAN_SQUARE:
        return found, None
    leads = [first, lead(model, found, runs)]
    if leads[1].mean_square <= max(SUSPECT_MEAN_SQUARE, NEARER_SHARE * first.mean_square):
        again = _fit_without_effects(model, let_go(model, leads[1], runs), runs)
        if again.cost < found.cost:
            found = again
            leads.append(lead(model, found, runs))
    return found, min(leads, key=lambda one: one.cost)


def _fit_without_effects(model: Model, near: FitValues, runs: Sequence[int]) -> FitResult:
    return fit(model, (), runs, near.values, near.states, lengths=near.lengths)
