"""A machine whose delay stands for a filter that a fit lacks."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, effect, linear


class Late(Line):
    """y = pulses that come late by b, behind three lags of `lag_size` together."""

    parameters = (
        linear("a", 0.0, std=10.0),
        replace(linear("b", 0.1, std=10.0), lower=0.0, upper=0.4),
    )

    def __init__(self, measured: Sequence[Array], plausible: float) -> None:
        super().__init__(measured, [])
        size = replace(linear("lag_size", plausible), lower=0.0, upper=1.0)
        self.candidates = {"lag": replace(effect("lag"), sizes=(size,))}

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            lag = v["lag_size"] if effects else 0.0
            return (self.measured[run] - v["a"] - late_pulses(v["b"], lag))[None, :]

        return residual


def late_pulses(by: float, lag: float) -> Array:
    """Pulses of 30, late by a time and behind three lags."""
    time = np.linspace(-2.0, 1.0, 3000)
    pole = float(np.exp(-(time[1] - time[0]) / max(lag / 3.0, 1e-4)))
    found = 30.0 * np.sign(np.sin(25.0 * time))
    for _ in range(3):
        found = lfilter([1.0 - pole], [1.0, -pole], found)
    return np.interp(TIME - by, time, found)
