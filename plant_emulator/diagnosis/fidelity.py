"""A linear regression of the data on nuisance parameters and effects, at one of two fidelities.

y = F theta + columns of effects + noise; F holds the columns of the nuisance parameters and of the
unknown start states. In the parity relations between samples a column shows what an effect breaks
at this instant; in the free simulation it shows what adds up over a run.
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
        """Parameters and states of the runs that belong to these nuisance coefficients."""
