"""The axis as a parameter set tells it, before the logs that are diagnosed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.regression.fit import NAMES

if TYPE_CHECKING:
    from plant_emulator.diagnosis.axis.effects import Effect
    from plant_emulator.diagnosis.axis.regression.fit import Fit
    from plant_emulator.diagnosis.axis.regression.rows import KnownEffect

# Standard errors from which on a parameter differs from that of the set.
DEVIATES = 3.0


@dataclass(frozen=True, kw_only=True)
class KnownAxis:
    """Nominal parameters and effects of an axis.

    values, errors : of NAMES, with standard errors, 0 where the set has none
    own : effects of the user's own files that the set names
    rotary : whether the set is that of an axis that turns
    """

    values: tuple[float, ...]
    errors: tuple[float, ...]
    effects: tuple[KnownEffect, ...]
    own: tuple[Effect, ...]
    rotary: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(one.term.effect.name for one in self.effects)

    def deviating(self, found: Fit) -> list[str]:
        """Names of the parameters of a fit that differ from those of the set."""
        errors = np.hypot(np.sqrt(np.diag(found.covariance)[: len(NAMES)]), self.errors)
        apart = np.abs(found.values[: len(NAMES)] - self.values) > DEVIATES * errors
        return [name for name, other in zip(NAMES, apart, strict=True) if other]
