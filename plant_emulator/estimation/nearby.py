"""Functions of a fit's unknowns whose simulations may follow the steps of another one (pure).

Steps that adapt jump where a value changes a little, and so does the result, by the tolerance. A
slope that is taken over a small change then loses its digits, unless both runs have the same steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from plant_emulator.errors import UnsettledError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from plant_emulator.signals.log import Array


@runtime_checkable
class Stepped(Protocol):
    """A function of the unknowns that simulates in steps."""

    def near(self, found: Mapping[str, float], /) -> Callable[[Mapping[str, float]], Any]:
        """The function for values beside these: it takes the steps of the run at these."""


def near(function: Any, found: Mapping[str, float]) -> Any:
    """The function for values beside these; the function itself where it has no steps."""
    return function.near(found) if isinstance(function, Stepped) else function


@dataclass(frozen=True)
class Changed:
    """A function of the unknowns, and what another function makes of its result."""

    function: Callable[[Mapping[str, float]], Any]
    change: Callable[[Any], Array]

    def __call__(self, found: Mapping[str, float], /) -> Array:
        """The changed result at these values."""
        return self.change(self.function(found))

    def near(self, found: Mapping[str, float], /) -> Changed:
        """See `Stepped`."""
        return Changed(near(self.function, found), self.change)


@dataclass(frozen=True)
class Beside:
    """A function of the unknowns beside, or in place of, values that stay as they are."""

    function: Callable[[Mapping[str, float]], Array]
    values: Mapping[str, float]

    def __call__(self, found: Mapping[str, float], /) -> Array:
        """The result at these values beside the others."""
        return self.function({**self.values, **found})

    def near(self, found: Mapping[str, float], /) -> Beside:
        """See `Stepped`."""
        return Beside(near(self.function, {**self.values, **found}), self.values)


@dataclass(frozen=True)
class OrImpossible:
    """A function of the unknowns, and its result where the model cannot be simulated.

    A search turns away from a huge result instead of ending.
    """

    function: Callable[[Mapping[str, float]], Array]
    impossible: Array

    def __call__(self, found: Mapping[str, float], /) -> Array:
        """The result at these values, or the impossible one."""
        try:
            return self.function(found)
        except UnsettledError:
            return self.impossible

    def near(self, found: Mapping[str, float], /) -> OrImpossible:
        """See `Stepped`."""
        return OrImpossible(near(self.function, found), self.impossible)
