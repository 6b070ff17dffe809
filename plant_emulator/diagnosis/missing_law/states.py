"""The states that a missing law may depend on, and first-order lags of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

    Kind = Literal["signed", "smooth", "level", "curved", "direction", "time", "angle", "followed"]

# Time constants of a lag that a law may have [s]: of a filter, and of something that warms up.
FILTER_TIMES = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
WARMING_TIMES = (10.0, 30.0, 100.0, 300.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class LawState:
    """A state that a missing law may depend on.

    symbol : letter in a formula; unit : of the state, empty for a pure number
    code : expression in an effect's law
    values : of each run, as its quantity asks for them: means over intervals, shape (n - 1,), or
        at the samples, shape (n,) [SI]; time : likewise [s]
    kind : which functions make sense; `followed` is a state that has a lag only, `curved` one whose
        multiple is no law, as that of an acceleration, which is an inertia
    lags : time constants that a lag of the state may have [s]; empty: none
    start : expression of a lag's value at the start of a run
    scanned : of an angle, the largest multiple of it that is looked for [1]
    multiples : of an angle, those whose ripple a law may have [1]
    """

    name: str
    symbol: str
    unit: str
    code: str
    kind: Kind
    values: Sequence[Array]
    time: Sequence[Array]
    lags: tuple[float, ...] = ()
    start: str = "0.0"
    scanned: float = 0.0
    multiples: tuple[float, ...] = ()

    @property
    def largest(self) -> float:
        """Largest absolute value in all runs [SI]."""
        return max(float(np.max(np.abs(own))) for own in self.values)


def lag_state(time: Array, value: Array, tau: float, start: float) -> Array:
    """First-order lag of a state, tau dx/dt = value - x, from `start` on, shape (n,).

    Exact for a value that holds over each interval.
    """
    from scipy.signal import lfilter

    share = float(-np.expm1(-np.median(np.diff(time)) / tau))
    found, _ = lfilter([share], [1.0, share - 1.0], value, zi=[(1.0 - share) * start])
    return np.asarray(found)


def play_state(value: Array, half: float, start: float) -> Array:
    """Play of half a width over a state (M. A. Krasnoselskii, Systems with Hysteresis, 1989)."""
    found, here = np.empty(len(value)), start
    for n, x in enumerate(value.tolist()):
        here = found[n] = max(x - half, min(x + half, here))
    return found
