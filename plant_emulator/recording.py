"""A log ready to be fitted: its inputs, and what of it counts in units of its own noise."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import IdentificationError, UnsettledError
from plant_emulator.log import Array, Log, compared
from plant_emulator.noise import noise
from plant_emulator.simulate import TOLERANCE, Hold, Run, run_of, simulate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

# Residual of values that the model cannot simulate [noise]: a bad place, but no end of a search.
IMPOSSIBLE = 100.0


@dataclass(frozen=True)
class Recording:
    """A log, the inputs of its simulation, and the noise of its compared channels [SI].

    use : samples that count, shape (channels, samples)
    own : values of the model that the log itself tells, such as the shell's temperature [SI]
    """

    log: Log
    run: Run
    channels: tuple[str, ...]
    noise: Array
    use: NDArray[np.bool_]
    own: Mapping[str, float] = field(default_factory=dict)

    def residual(
        self, values: Mapping[str, float], gap_position: float, tolerance: float = TOLERANCE
    ) -> Array:
        """Measured minus simulated over the noise, shape (channels, samples)."""
        try:
            return self.settled(values, gap_position, tolerance)
        except UnsettledError:
            return np.where(self.use, IMPOSSIBLE, 0.0)

    def settled(
        self, values: Mapping[str, float], gap_position: float, tolerance: float = TOLERANCE
    ) -> Array:
        """The same; UnsettledError where the model cannot be simulated at these values."""
        found = simulate(self.run, values, gap_position=gap_position, tolerance=tolerance)
        difference = np.stack([self.log[name] - found[name] for name in self.channels])
        return np.where(self.use, difference / self.noise[:, None], 0.0)

    def fed(self, wheel_torque: Array) -> Recording:
        """The same log simulated with another wheel torque [N m], shape (n,)."""
        return replace(self, run=replace(self.run, wheel_torque=wheel_torque))


def recording(
    log: Log,
    hold: Hold | None = None,
    use: Mapping[str, NDArray[np.bool_]] | None = None,
) -> Recording:
    """A log as it is fitted.

    use : samples that count, by channel; all where a channel is not named
    """
    channels = compared(log)
    everything = np.ones(len(log.time), bool)
    counted = np.stack([(use or {}).get(name, everything) for name in channels])
    levels = [noise(log[name], counted[k]) for k, name in enumerate(channels)]
    if not all(level > 0.0 for level in levels):
        still = channels[int(np.argmin(levels))]
        raise IdentificationError(
            f"{log.source}: {still} does not move; a run that excites it is needed"
        )
    return Recording(log, run_of(log, hold), channels, np.array(levels), counted)
