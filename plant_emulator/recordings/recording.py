"""A log ready to be fitted: inputs of its simulation, samples that count, and their noise."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import nan
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from plant_emulator.errors import IdentificationError, UnsettledError
from plant_emulator.recordings.stamps import TELLING_SLOPE
from plant_emulator.recordings.wheel_torque import is_estimated
from plant_emulator.signals.log import (
    INPUT_ERRORS,
    TIMING_ERROR,
    VOLTAGE,
    WHEEL_TORQUE,
    Array,
    Log,
    compared_channels,
    without_voltage,
)
from plant_emulator.signals.mains import noise_beside_lines
from plant_emulator.signals.noise import FLOOR, noise, value_step
from plant_emulator.simulation.run_inputs import Hold, RunInputs, inputs_of
from plant_emulator.simulation.simulate import TOLERANCE, MeasuredSpeeds, simulate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from plant_emulator.model.sensors import Sensor

# What is known of the voltage's sensor beforehand: its offset [V] and the error of its gain, each
# run's own. An isolating amplifier of 500 V and 0.2 % is off by 1 V; a divider by some 0.5 %.
OFFSET, GAIN_ERROR = 1.0, 0.005
# What is known of the quantiser of a coarse channel: each run's offset, and the error of its gain
# at the largest values [steps]. Noise of half a step smooths the steps, and two roundings one after
# the other leave some percent of them. Finer channels have noise enough.
QUANTISER_ERROR = 0.1
# Quantile of a channel's values that counts as the largest: spikes are larger.
LARGEST = 0.99
# Residual where the model cannot be simulated [noise]: a search turns back there, and goes on.
IMPOSSIBLE = 100.0


@dataclass(frozen=True)
class Recording:
    """A log, the inputs of its simulation, and the noise of its compared channels [SI].

    use : samples that count, shape (channels, samples)
    logged_values : values of the model that the log measures, such as a temperature, by name [SI]
    quantiser_errors : offset [SI] and error of the gain [1] of coarse channels, by name
    """

    log: Log
    inputs: RunInputs
    channels: tuple[str, ...]
    noise: Array
    use: NDArray[np.bool_]
    logged_values: Mapping[str, float] = field(default_factory=dict)
    quantiser_errors: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def estimated_torque(self) -> bool:
        """Whether a truck's wheel torque is unknown, and its input an estimate."""
        return is_estimated(self.log)

    @property
    def uncertain_inputs(self) -> bool:
        """Whether an input has noise of its own, or is not known in a hole or where rows jitter."""
        unknown = [self.log[error] for error in INPUT_ERRORS.values() if error in self.log]
        return self.inputs.truck or any(off.any() for off in (*unknown, self.stamp_errors))

    @property
    def stamp_errors(self) -> Array:
        """Deviation of the reference at rows whose time it does not tell [rad/s], shape (n,).

        These are rows beside corners, and on ramps shorter than the windows of `stamps`; it is 0
        elsewhere. A log whose reference tells no time at all has none: it is a staircase. Rows that
        were inserted in a hole have its error.
        """
        if self.inputs.truck or TIMING_ERROR not in self.log:
            return np.zeros_like(self.log.time)
        errors = self.log[TIMING_ERROR]
        rate = np.abs(np.gradient(self.log["speed_reference"], self.log.time))
        untold = (errors == errors.max()) & (errors.min() < errors.max()) & self.use.any(axis=0)
        return np.where(untold & (rate > TELLING_SLOPE), errors * rate, 0.0)

    @property
    def noise_ratio(self) -> Array:
        """Deviation of each sample's noise over its channel's [1], shape (channels, samples).

        The shape is (channels, 1) where all samples are alike.

        A row that was taken early or late is off by the rate of change of each channel. The rate is
        the measured one, so that all hypotheses are judged alike; that of samples that count, so
        that a held channel does not jump; and that of medians of three, so that a spike has none.
        It is the larger one of both sides, because nobody knows on which side of a sample a contact
        falls.
        """
        if TIMING_ERROR not in self.log:
            return np.ones((len(self.channels), 1))
        rates = np.zeros(self.use.shape)
        for row, (name, use) in enumerate(zip(self.channels, self.use, strict=True)):
            time, value = self.log.time[use], np.pad(self.log[name][use], 1, mode="edge")
            middle = np.median(np.stack([value[:-2], value[1:-1], value[2:]]), axis=0)
            rate = np.abs(np.diff(middle) / np.diff(time))
            rates[row, use] = np.maximum(np.pad(rate, (1, 0)), np.pad(rate, (0, 1)))
        return np.asarray(np.hypot(1.0, self.log[TIMING_ERROR] * rates / self.noise[:, None]))

    def measured_speeds(self, interval: float) -> MeasuredSpeeds:
        """The speeds that count, to lead a simulation along.

        They are medians of five, without spikes of up to two samples. The dead zone is the noise of
        one sample, several times that of a mean where the noise is white. It is at least half of a
        step: the medians of a coarse channel stay on one.
        """
        names = ("motor_speed", "drum_speed")
        speeds, dead_zones = {}, np.zeros(len(names))
        for k, name in enumerate(names):
            speeds[name] = np.full(len(self.log.time), nan)
            if name not in self.channels:
                continue
            row = self.channels.index(name)
            use = self.use[row]
            if use.any():
                shown = self.log[name][use]
                dead_zones[k] = max(self.noise[row], 0.5 * value_step(shown))
                value = np.pad(shown, 2, mode="edge")
                speeds[name][use] = np.median(sliding_window_view(value, 5), axis=-1)
        return MeasuredSpeeds(**speeds, interval=interval, dead_zones=dead_zones)

    def residual(
        self,
        values: Mapping[str, float],
        gap_position: float,
        tolerance: float = TOLERANCE,
        largest_step: float | None = None,
    ) -> Array:
        """Whitened residual: measured minus simulated over the noise, shape (channels, samples).

        Noise, gain and offset of the voltage's sensor, or of the quantiser of a coarse channel,
        together have the covariance 1 + X X' with X the errors over the noise. The residual is
        multiplied by the inverse of the square root of that covariance. The errors follow from the
        simulated value, because the noise of the measured one would explain a part of itself.

        Where the model cannot be simulated at these values, every sample is IMPOSSIBLE.
        """
        try:
            return self.strict_residual(values, gap_position, tolerance, largest_step)
        except UnsettledError:
            return np.where(self.use, IMPOSSIBLE, 0.0)

    def strict_residual(
        self,
        values: Mapping[str, float],
        gap_position: float,
        tolerance: float = TOLERANCE,
        largest_step: float | None = None,
    ) -> Array:
        """Residual as in `residual`; raises UnsettledError where the model cannot be simulated."""
        found = simulate(
            self.inputs,
            values,
            gap_position=gap_position,
            tolerance=tolerance,
            largest_step=largest_step,
        )
        return self.residual_of(found)

    def residual_of(self, found: Log) -> Array:
        """Residual as in `residual`, of a simulated log."""
        difference = np.stack([self.log[name] - found[name] for name in self.channels])
        deviation = self.noise[:, None] * self.noise_ratio
        white = np.where(self.use, difference / deviation, 0.0)
        for row, name in enumerate(self.channels):
            if name == VOLTAGE:
                errors = voltage_errors(found[name])
            elif name in self.quantiser_errors:
                errors = sensor_errors(found[name], *self.quantiser_errors[name])
            else:
                continue
            errors = errors / deviation[row][:, None] * self.use[row][:, None]
            white[row] = whiten_sensor_errors(white[row], errors)
        return white

    def with_noise_beside(self, values: Mapping[str, float]) -> Recording:
        """The recording with the noise that shows beside a simulation, where that is less.

        A regulator that answers the noise of its torque sensor moves the reference at every sample,
        and so do commands that reach the PLC now early, now late. Third differences then take what
        the bench does for noise: 13 A of current for 0.3 A. Most of it is in a simulation too, even
        at parameters that are some percent off.

        values : of the model [SI]
        """
        try:
            rows = self.strict_residual(values, gap_position=0.0) * self.noise[:, None]
        except UnsettledError:
            return self
        beside = [
            max(noise(row, use), FLOOR * float(np.ptp(self.log[name])))
            for name, row, use in zip(self.channels, rows, self.use, strict=True)
        ]
        return replace(self, noise=np.minimum(self.noise, beside))

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

    def with_noise(self, levels: Array) -> Recording:
        """The recording with another noise of its channels [SI], shape (channels,).

        A channel whose values are further apart than its noise is coarse.
        """
        errors = {}
        for name, level, own in zip(self.channels, levels, self.use, strict=True):
            values = self.log[name][own]
            if (step := value_step(values)) > level:
                largest = max(step, float(np.quantile(np.abs(values), LARGEST)))
                errors[name] = QUANTISER_ERROR * step, QUANTISER_ERROR * step / largest
        return replace(self, noise=levels, quantiser_errors=errors)

    def with_wheel_torque(self, wheel_torque: Array) -> Recording:
        """The recording with another wheel torque as its input [N m], shape (n,)."""
        return replace(self, inputs=replace(self.inputs, wheel_torque=wheel_torque))

    def with_input_off(self, name: str, off: Array) -> Recording:
        """The recording with an input that is off by this [SI], shape (n,)."""
        run = self.inputs
        if name == WHEEL_TORQUE:
            return self.with_wheel_torque(run.wheel_torque + off)
        nodes, slope = run.nodes, run.slope
        if nodes is not None:
            nodes = (nodes[0], nodes[1] + np.interp(nodes[0], run.time, off))
        if slope.any():  # no staircase
            slope = slope + np.append(np.diff(off) / np.diff(run.time), 0.0)
        inputs = replace(run, reference=run.reference + off, slope=slope, nodes=nodes)
        return replace(self, inputs=inputs)


def voltage_errors(voltage: Array) -> Array:
    """Standard deviations of the voltage that its sensor's offset and gain make [V], shape (n, 2).

    voltage : shape (n,) [V]
    """
    return sensor_errors(voltage, OFFSET, GAIN_ERROR)


def sensor_errors(value: Array, offset: float, gain_error: float) -> Array:
    """Standard deviations of a value that its sensor's offset and gain make [SI], shape (n, 2).

    value : shape (n,) [SI]; offset [SI], gain_error [1] : standard deviations
    """
    return np.stack([np.full(len(value), offset), gain_error * value], axis=-1)


def whiten_sensor_errors(residual: Array, errors: Array) -> Array:
    """Whiten a residual for errors of its sensor beside white noise of variance 1; shape (n,).

    (1 + X X')^(-1/2) r, computed from the eigenvalues of X'X

    residual : r, shape (n,); errors : X, shape (n, k)
    """
    squares, vectors = np.linalg.eigh(errors.T @ errors)
    squares = np.maximum(squares, 1e-12)
    lost = (1.0 - 1.0 / np.sqrt(1.0 + squares)) / squares
    return np.asarray(residual - errors @ (vectors @ (lost * (vectors.T @ (errors.T @ residual)))))


def recording(
    log: Log,
    hold: Hold | None = None,
    use: Mapping[str, NDArray[np.bool_]] | None = None,
    sensors: Mapping[str, Sensor] | None = None,
) -> Recording:
    """Prepare a log for a fit: its inputs, compared channels and their noise.

    use : samples that count, by channel, shape (n,); None: all samples of all channels. A channel
        without an entry counts whole. A voltage without an entry is removed, from the log too.
    sensors : declared sensors by channel; a value that its task only holds does not count, and a
        declared noise takes the place of the estimate
    Raises IdentificationError for a channel that does not move.
    """
    if use is not None and VOLTAGE not in use:
        log = without_voltage(log)
    channels = compared_channels(log)
    everything = np.ones(len(log.time), bool)
    counted = np.stack([(use or {}).get(name, everything) for name in channels])
    inputs = inputs_of(log, hold, sensors)
    if inputs.sensing is not None:
        counted &= np.stack([inputs.sensing.has_new_reading(name) for name in channels])
    known = {name: sensor.noise for name, sensor in (sensors or {}).items()}
    levels = [
        known.get(name) or noise_beside_lines(log.time, log[name], use)
        for name, use in zip(channels, counted, strict=True)
    ]
    if not all(level > 0.0 for level in levels):
        still = channels[int(np.argmin(levels))]
        raise IdentificationError(
            f"{log.source}: {still} does not move; a run that excites it is needed"
        )
    noise = np.array(levels)
    return Recording(log, inputs, channels, noise, counted).with_noise(noise)
