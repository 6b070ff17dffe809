"""A log ready to be fitted: its inputs, and what of it counts in units of its own noise."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import IdentificationError, UnsettledError
from plant_emulator.signals.log import VOLTAGE, Array, Log, compared_channels, without_voltage
from plant_emulator.signals.noise import noise
from plant_emulator.simulation.simulate import TOLERANCE, Hold, RunInputs, inputs_of, simulate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

# What is known of the voltage's sensor beforehand: its offset [V] and the error of its gain, each
# run's own. An isolating amplifier of 500 V and 0.2 % is off by 1 V; a divider by some 0.5 %.
OFFSET, GAIN_ERROR = 1.0, 0.005
# Residual of values that the model cannot simulate [noise]: a bad place, but no end of a search.
IMPOSSIBLE = 100.0


@dataclass(frozen=True)
class Recording:
    """A log, the inputs of its simulation, and the noise of its compared channels [SI].

    use : samples that count, shape (channels, samples)
    own : values of the model that the log itself tells, such as the shell's temperature [SI]
    """

    log: Log
    inputs: RunInputs
    channels: tuple[str, ...]
    noise: Array
    use: NDArray[np.bool_]
    logged_values: Mapping[str, float] = field(default_factory=dict)

    def residual(
        self, values: Mapping[str, float], gap_position: float, tolerance: float = TOLERANCE
    ) -> Array:
        """Measured minus simulated over the noise, shape (channels, samples).

        The voltage's is whitened: its noise and the unknown gain and offset of its sensor together
        have the covariance 1 + X X', X the errors over the noise, and the residual is multiplied by
        the inverse of its square root. The errors follow from the simulated voltage: the noise of a
        measured one would pass for a part of itself.
        """
        try:
            return self.strict_residual(values, gap_position, tolerance)
        except UnsettledError:
            return np.where(self.use, IMPOSSIBLE, 0.0)

    def strict_residual(
        self, values: Mapping[str, float], gap_position: float, tolerance: float = TOLERANCE
    ) -> Array:
        """The same; UnsettledError where the model cannot be simulated at these values."""
        found = simulate(self.inputs, values, gap_position=gap_position, tolerance=tolerance)
        difference = np.stack([self.log[name] - found[name] for name in self.channels])
        white = np.where(self.use, difference / self.noise[:, None], 0.0)
        if VOLTAGE in self.channels:
            row = self.channels.index(VOLTAGE)
            errors = voltage_errors(found[VOLTAGE]) / self.noise[row]
            white[row] = whiten_sensor_errors(white[row], errors * self.use[row][:, None])
        return white

    def without_voltage(self) -> Recording:
        """The recording as it would be if nobody had connected the voltage."""
        kept = [k for k, name in enumerate(self.channels) if name != VOLTAGE]
        return replace(
            self,
            log=without_voltage(self.log),
            channels=tuple(self.channels[k] for k in kept),
            noise=self.noise[kept],
            use=self.use[kept],
        )

    def with_wheel_torque(self, wheel_torque: Array) -> Recording:
        """The same log simulated with another wheel torque [N m], shape (n,)."""
        return replace(self, inputs=replace(self.inputs, wheel_torque=wheel_torque))


def voltage_errors(voltage: Array) -> Array:
    """What the voltage's sensor may be off by in offset and gain, a standard deviation of each [V],
    shape (n, 2).
    """
    return np.stack([np.full(len(voltage), OFFSET), GAIN_ERROR * voltage], axis=-1)


def whiten_sensor_errors(residual: Array, errors: Array) -> Array:
    """A residual, shape (n,), whitened for errors of its sensor, shape (n, k), beside white noise.

    (1 + X X')^(-1/2) r, by the eigenvalues of X'X.
    """
    squares, vectors = np.linalg.eigh(errors.T @ errors)
    squares = np.maximum(squares, 1e-12)
    lost = (1.0 - 1.0 / np.sqrt(1.0 + squares)) / squares
    return np.asarray(residual - errors @ (vectors @ (lost * (vectors.T @ (errors.T @ residual)))))


def recording(
    log: Log,
    hold: Hold | None = None,
    use: Mapping[str, NDArray[np.bool_]] | None = None,
) -> Recording:
    """A log as it is fitted.

    use : samples that count, by channel; all where a channel is not named, but for a voltage, which
        is then left out, of the log too; None: all of all channels
    """
    if use is not None and VOLTAGE not in use:
        log = without_voltage(log)
    channels = compared_channels(log)
    everything = np.ones(len(log.time), bool)
    counted = np.stack([(use or {}).get(name, everything) for name in channels])
    levels = [noise(log[name], counted[k]) for k, name in enumerate(channels)]
    if not all(level > 0.0 for level in levels):
        still = channels[int(np.argmin(levels))]
        raise IdentificationError(
            f"{log.source}: {still} does not move; a run that excites it is needed"
        )
    return Recording(log, inputs_of(log, hold), channels, np.array(levels), counted)
