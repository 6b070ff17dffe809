"""A machine with an effect that does nearly all by a state of each run, times its size."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, effect, linear, noisy

# Size of the effect, start of its state, and the states in two runs.
SIZE, START, STATES = 0.5, 20.0, (23.0, 18.0)


class Warm(Line):
    """y = a + b x + s (0.1 x^2 + (T - 20) sin(20 x)), with the state T of each run."""

    def __init__(self, size: float = SIZE) -> None:
        super().__init__([noisy(warm(size, own), k) for k, own in enumerate(STATES)], [])
        state = linear("warm_state", START, prior=START, std=4.0)
        self.candidates = {"warm": replace(effect("warm"), states=(state,))}

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            y = v["a"] + v["b"] * TIME
            if effects:
                y = y + warm(v["warm_size"], v["warm_state"])
            return (self.measured[run] - y)[None, :]

        return residual


def warm(size: float, state: float) -> Array:
    """What the effect adds."""
    return size * (0.1 * TIME**2 + (state - START) * np.sin(20.0 * TIME))
