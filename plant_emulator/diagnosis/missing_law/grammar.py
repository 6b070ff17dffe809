"""The grammar of laws: short formulas of the states, as values, as text, and as code.

A term is a coefficient times one or two factors. A factor is a function of one state:

    1   x   |x|   x|x|   sqrt|x|   sign x   exp(-(x/s)^2)   lag of x   cos(k x + phase)
    play of x

s, the time constant of a lag, and the half width of a play come from a grid. The fit by simulation
moves them afterwards. The multiple k of an angle comes from a scan of the runs (`line_scan`).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np

from plant_emulator.diagnosis.missing_law.states import lag_state, play_state

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from plant_emulator.diagnosis.missing_law.states import LawState
    from plant_emulator.signals.log import Array

    Function = Literal[
        "linear", "size", "square", "root", "sign", "bell", "delay", "lag", "turn", "play"
    ]

# Functions without a scale.
PLAIN: dict[str, Callable[[Array], Array]] = {
    "linear": lambda x: x,
    "size": np.abs,
    "square": lambda x: x * np.abs(x),
    "root": lambda x: np.sign(x) * np.sqrt(np.abs(x)),
    "sign": np.sign,
}
# Widths of a bell [largest value of the state].
BELL_WIDTHS = (0.02, 0.05, 0.1, 0.2, 0.5)
# Half widths of a play [largest value of the state].
PLAY_WIDTHS = (0.005, 0.01, 0.02, 0.05)

# Functions of each kind of state that make a factor; those with a scale come from its grid.
FUNCTIONS: dict[str, tuple[Function, ...]] = {
    "signed": ("linear", "size", "square", "root", "sign", "bell"),
    "smooth": ("linear", "size", "square", "bell"),
    "level": ("linear", "square", "root", "bell"),
    "curved": ("size", "square"),
    "direction": ("linear",),
    "time": ("linear", "bell"),
    "angle": ("turn",),
    "followed": (),
}


@dataclass(frozen=True, eq=False)
class Factor:
    """A function of one state; scale : width [unit], time constant [s] or multiple, else 0.

    delay, play : lag and play of the state, minus the state; lag : the lag itself
    """

    function: Function
    state: LawState
    scale: float = 0.0

    def values(self, run: int) -> Array:
        """Values over the intervals of a run, shape (n - 1, 1), or (n - 1, 2) for a turn."""
        x = self.state.values[run]
        if self.function == "turn":
            return np.stack([np.cos(self.scale * x), np.sin(self.scale * x)], axis=-1)
        return np.asarray(self._plain(x, self.state.time[run]))[:, None]

    def _plain(self, x: Array, time: Array) -> Array:
        if self.function == "delay":
            return lag_state(time, x, self.scale, float(x[0])) - x
        if self.function == "lag":
            return lag_state(time, x, self.scale, 0.0)
        if self.function == "bell":
            return np.asarray(np.exp(-((x / self.scale) ** 2)))
        if self.function == "play":
            return play_state(x, self.scale, 0.0) - x
        return np.asarray(PLAIN[self.function](x))

    @property
    def text(self) -> str:
        """The factor as text, with its scale to two digits."""
        x, s = self.state.symbol, f"{self.scale:.2g}"
        level = self.state.kind in {"level", "time"}
        return {
            "linear": x,
            "size": f"|{x}|",
            "square": f"{x}^2" if level else f"{x} |{x}|",
            "root": f"sqrt({x})" if level else f"sign({x}) sqrt(|{x}|)",
            "sign": f"sign({x})",
            "bell": f"exp(-({x}/{s})^2)",
            "delay": f"(lag({x}, {s} s) - {x})",
            "lag": f"lag({x}, {s} s)",
            "turn": f"cos({self.scale:.4g} {x} + phase)",
            "play": f"(play({x}, {s}) - {x})",
        }[self.function]

    @property
    def at_rest(self) -> bool:
        """Whether the factor does not vanish where its state does."""
        return self.function in {"bell", "sign", "turn"} or self.state.kind == "direction"


@dataclass(frozen=True, eq=False)
class Term:
    """A product of factors; none of them: a constant."""

    factors: tuple[Factor, ...]

    def values(self, run: int, count: int) -> Array:
        """Values over the `count` intervals of a run, shape (count, 1 or 2)."""
        found = np.ones((count, 1))
        for factor in self.factors:
            found = found * factor.values(run)
        return found

    @property
    def turn(self) -> int:
        """Number of the factor of an angle, from 1 on; 0: there is none."""
        return next((j for j, f in enumerate(self.factors, 1) if f.function == "turn"), 0)

    @property
    def own(self) -> bool:
        """Whether each run has coefficients of its own: where an angle starts is not known."""
        return self.turn > 0

    @property
    def text(self) -> str:
        """The term as text without its coefficient; empty for a constant."""
        return " ".join(factor.text for factor in self.factors)

    @property
    def states(self) -> tuple[LawState, ...]:
        """The states of the term."""
        return tuple(factor.state for factor in self.factors)


def terms(states: Sequence[LawState]) -> list[Term]:
    """All terms of these states: a constant, single factors, and products of two of them."""
    single = [Term((factor,)) for state in states for factor in factors(state)]
    products = [
        Term((one, other))
        for first, second in combinations(states, 2)
        for one in _paired(first, second)
        for other in _paired(second, first)
    ]
    return [Term(()), *single, *products]


def factors(state: LawState) -> Iterator[Factor]:
    """All factors of a state."""
    for function in FUNCTIONS[state.kind]:
        if function == "bell":
            yield from (Factor("bell", state, w * state.largest) for w in BELL_WIDTHS)
        elif function == "turn":
            yield from (Factor("turn", state, k) for k in state.multiples)
        else:
            yield Factor(function, state)
    follows = state.kind in {"followed", "signed"}
    yield from (Factor("delay" if follows else "lag", state, tau) for tau in state.lags)
    if state.kind == "signed" and state.lags:
        yield from (Factor("play", state, w * state.largest) for w in PLAY_WIDTHS)


def _paired(state: LawState, other: LawState) -> Iterator[Factor]:
    """Factors of a state in a product with another one; a direction takes any bell of a speed."""
    if state.kind == "signed" and other.kind == "direction":
        yield from (f for f in factors(state) if f.function in {"size", "root", "square", "bell"})
    else:
        yield from _simple(state)


def _simple(state: LawState) -> Iterator[Factor]:
    """Factors that a product may have: of first order, a root, a wide bell, a lag, a turn."""
    for factor in factors(state):
        wide = factor.function == "bell" and factor.scale >= BELL_WIDTHS[2] * state.largest
        if factor.function in {"linear", "size", "root", "lag", "turn"} or wide:
            yield factor
