"""What an effect does to the data, at one of two fidelities: local relations, or free simulation.

Both are one linear regression, y = F theta + columns of effects + noise. F is what the nuisance
parameters and unknown starts do. The relations see what an effect breaks at this instant, the
simulation sees what adds up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from plant_emulator.diagnosis.fit_result import FitValues
    from plant_emulator.estimation.regression import Regression
    from plant_emulator.signals.log import Array

# Values by name, and the states of each run by name.
Values = tuple["dict[str, float]", "list[dict[str, float]]"]


class Fidelity(Protocol):
    """One linear regression around a fit."""

    @property
    def where(self) -> FitValues:
        """The fit."""

    @property
    def data(self) -> Regression:
        """Data and nuisance columns."""

    @property
    def owners(self) -> NDArray[np.int_]:
        """Run that each row belongs to, shape (n,)."""

    def column(
        self, effect: str, sizes: Mapping[str, float], states: Sequence[Mapping[str, float]]
    ) -> Array | None:
        """Change of the data with one more effect, shape (n,); None: it cannot be simulated."""

    def unwhitened(
        self, effect: str, sizes: Mapping[str, float], states: Sequence[Mapping[str, float]]
    ) -> Array | None:
        """The column before the noise that the rows show themselves is whitened."""

    def values_at(self, theta: Array) -> Values:
        """Parameters, and states of the runs, at these nuisance coefficients."""
