"""Hysteresis of a sensor: what a residual repeats with the history of its own quantity (pure).

    play:  y_k = max(x_k - h, min(x_k + h, y_(k-1)))        x : true value; h : half width

A sensor with friction or magnetic hysteresis shows y for x (M. Brokate, J. Sprekels, Hysteresis and
Phase Transitions (1996), chapter 2). Its error y - x wanders slowly and looks like noise with a
long memory, but noise does not follow the quantity. The gain of the error is that of a regression
in the noise that the residual itself shows, beside an offset, the quantity and its rate of change:
what a memory, a gain or a lag explains is no hysteresis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimation.noise.autoregression import fit_autoregression
from plant_emulator.estimation.noise.channel_noise import ChannelNoise, Whitener

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array

# Half widths that are tried, in deviations of the noise: narrower play drowns in the noise, and a
# wider one has nearly the same course until it reverses.
HALF_WIDTHS = (1.0, 3.0, 10.0)
# Memory of the noise [samples], which Akaike's criterion shortens, and its least deviation.
MEMORY, AKAIKE, LEAST = 60, 2.0, 0.1
# Share of an error beside the other columns below which rounding is left of it.
ROUNDING = 1e-9


@dataclass(frozen=True)
class ShownValues:
    """What a sensor shows in one run, shape (n,) each.

    time : [s]; quantity : simulated, in deviations of the noise; residual : measured minus
        simulated, likewise; use : samples that count
    """

    time: Array
    quantity: Array
    residual: Array
    use: NDArray[np.bool_]


def hysteresis_squares(runs: Sequence[ShownValues]) -> float:
    """Squares of the residuals that a hysteresis of the best half width holds [chi squared]."""
    runs = [one for one in runs if one.residual[one.use].any()]
    if not runs:
        return 0.0
    counted, times = [one.residual[one.use] for one in runs], [one.time[one.use] for one in runs]
    colour = fit_autoregression(counted, times, MEMORY, AKAIKE, LEAST)
    whiteners = [Whitener(ChannelNoise(colour=colour), one.use, one.time) for one in runs]

    def white(rows: Sequence[Array]) -> Array:
        return np.concatenate([w.innovations(r) for w, r in zip(whiteners, rows, strict=True)])

    other = [
        white([np.ones_like(one.time) for one in runs]),
        white([one.quantity for one in runs]),
        white([np.gradient(one.quantity, one.time) for one in runs]),
    ]
    known, _ = np.linalg.qr(np.stack(other, axis=-1))
    left = white([one.residual for one in runs])
    found = 0.0
    for half_width in HALF_WIDTHS:
        error = white([play(one.quantity, half_width) - one.quantity for one in runs])
        column = error - known @ (known.T @ error)
        length = float(column @ column)
        if length > ROUNDING * float(error @ error):
            found = max(found, float(column @ left) ** 2 / length)
    return found


def play(value: Array, half_width: float) -> Array:
    """The play operator of a half width, from its middle on, shape (n,)."""
    shown, out = float(value[0]), np.empty_like(value)
    for k, x in enumerate(value.tolist()):
        shown = max(x - half_width, min(x + half_width, shown))
        out[k] = shown
    return out
