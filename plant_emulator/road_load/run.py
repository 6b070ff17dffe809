"""Prepares a pair of road logs for the fit: one time window, one low pass, one grid (pure).

The truck is simulated at the torque's sample rate. The simulated velocity passes the same low pass
as the measured velocity. It is then interpolated at the times of the measured samples.

The residual holds two kinds of noise. The speed sensor's noise is white. The truck integrates the
load cell's noise to a random walk, which ends when the truck stands. A Kalman filter of this walk
whitens the residual (`random_walk_filter`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.road_load import truck_model
from plant_emulator.road_load.clock_offset import LEAST_OVERLAP, clock_ahead
from plant_emulator.road_load.signal import find_rests, low_pass, noise, trim

if TYPE_CHECKING:
    from plant_emulator.road_load.signal import Mask, Signal
    from plant_emulator.road_load.truck_model import RoadParameters, Truck
    from plant_emulator.signals.log import Array

USED_RATE = 100.0
"""Largest rate of the compared samples [1/s]."""
EDGE = 0.2
"""Time at both ends that is not compared, because the low pass has one side only [s]."""
CREEP = 0.05
"""Speed below which only standstill is compared [m/s]. The random walk ends at the moment of the
stop, so the residual close to it would get too much weight."""
QUIETEST = (0.02, 0.001)
"""Smallest noise of torque [N m] and velocity [m/s]; below it the model's error dominates."""
UNSURE = (0.3, 0.5)
"""Time after a stop and before a start in which the motor's torque may not be 0 [s]."""
LEAST_REST = 0.3
"""Shortest standstill that is used, without the times of UNSURE [s]."""
BRIDGED_GAP = 0.05
"""Longest hole in the torque that is interpolated [s], because its impulse moves the truck."""


@dataclass(frozen=True, kw_only=True)
class RoadRun:
    """A truck's two logs, prepared for the fit.

    first : index of the first simulated torque sample
    held : torque samples at which the truck is known to stand, shape (n,)
    time : of the compared samples on the velocity's clock [s], shape (m,)
    measured : velocity after the low pass [m/s], shape (m,)
    valid, rests, moves : where samples count, the truck stands, the truck moves, shape (m,) each
    ahead : first estimate of the clock offset [s]; cutoff : of the low pass [Hz]
    """

    truck: Truck
    torque: Signal
    velocity: Signal
    first: int
    held: Mask
    time: Array
    measured: Array
    valid: Mask
    rests: Mask
    moves: Mask
    ahead: float
    cutoff: float

    @property
    def moving_start(self) -> bool:
        """Whether the truck moves at the start of the common window."""
        return not bool(self.rests[0])

    @cached_property
    def spacing(self) -> float:
        """Time between compared samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def masks(self) -> tuple[Mask, Mask, Mask]:
        """The masks valid, rests, moves."""
        return self.valid, self.rests, self.moves

    @cached_property
    def torque_noise(self) -> float:
        """Standard deviation of the noise of a torque sample [N m]."""
        return max(noise(self.torque.values), QUIETEST[0])

    @cached_property
    def velocity_noise(self) -> float:
        """Standard deviation of the noise of a compared velocity sample [m/s].

        The low pass reduces white noise like a mean over the samples of one spacing.
        """
        shrink = self.velocity.period / self.spacing
        return max(noise(self.velocity.values), QUIETEST[1]) * float(np.sqrt(shrink))

    def simulate(self, parameters: RoadParameters) -> Array:
        """Simulated velocity after the low pass, at the torque's samples from `first` on [m/s]."""
        torque = self.torque.values[self.first :]
        period = self.torque.period
        found = truck_model.velocity(
            parameters, self.truck, torque, self.held[self.first :], period
        )
        return low_pass(found, period, self.cutoff)

    def simulated_velocity(self, parameters: RoadParameters, time: Array) -> Array:
        """Simulated velocity at these times on the velocity's clock [m/s]."""
        late = parameters.clock_skew * (time - self.velocity.start) + parameters.clock_ahead
        torque_time = self.torque.time[self.first :]
        return np.interp(time + late, torque_time, self.simulate(parameters))

    def residual(self, parameters: RoadParameters) -> Array:
        """Measured minus simulated velocity [m/s], shape (m,)."""
        return self.measured - self.simulated_velocity(parameters, self.time)


def prepare(torque: Signal, velocity: Signal, truck: Truck) -> RoadRun:
    """Prepare the two logs of a run. Raises LogError if they cannot be compared."""
    _check_holes(torque)
    ahead = clock_ahead(torque, velocity)
    step = max(1, round(1.0 / (velocity.period * USED_RATE)))
    period = step * velocity.period
    cutoff = 0.4 / max(period, torque.period)
    smooth = low_pass(velocity.values, velocity.period, cutoff)
    begin = max(torque.start, velocity.start + ahead)
    first = int(np.ceil((begin - torque.start) / torque.period - 1e-6))
    end = min(torque.end, velocity.end + ahead) - EDGE
    inside = (velocity.time + ahead >= begin + EDGE) & (velocity.time + ahead <= end)
    chosen = np.flatnonzero(inside)[::step]
    rests = find_rests(velocity.values, velocity.period)
    samples = [round(part / velocity.period) for part in (*UNSURE, LEAST_REST)]
    stands = trim(rests, *samples)
    moves = np.abs(smooth) > CREEP
    valid = _far_from_holes(velocity, 0.5 / cutoff) & (moves | stands)
    _check_amount(valid[chosen], period, torque, velocity)
    nearest = np.round((torque.time - ahead - velocity.start) / velocity.period).astype(np.int64)
    held = stands[np.clip(nearest, 0, len(stands) - 1)]
    return RoadRun(
        truck=truck,
        torque=torque,
        velocity=velocity,
        first=first,
        held=held,
        time=velocity.time[chosen],
        measured=smooth[chosen],
        valid=valid[chosen],
        rests=rests[chosen],
        moves=moves[chosen],
        ahead=ahead,
        cutoff=cutoff,
    )


def _far_from_holes(velocity: Signal, reach: float) -> Mask:
    """Samples that are further than `reach` [s] from any hole, shape (n,)."""
    width = 2 * round(reach / velocity.period) + 1
    missing = np.convolve(~velocity.valid, np.ones(width), mode="same")
    return missing < 0.5


def _check_amount(valid: Mask, period: float, torque: Signal, velocity: Signal) -> None:
    length = period * int(np.count_nonzero(valid))
    if length < LEAST_OVERLAP:
        raise LogError(
            f"{torque.source}, {velocity.source}: only {length:.3g} s can be compared; at least "
            f"{LEAST_OVERLAP:g} s of the same travel are needed in both"
        )


def _check_holes(torque: Signal) -> None:
    for start, length in torque.holes():
        if length > BRIDGED_GAP:
            raise LogError(
                f"{torque.source}: no torque (missing, held or saturated) for {length:.3g} s from "
                f"{start:.4g} s on; the speed after it is unknown, at most {BRIDGED_GAP:g} s "
                "can be bridged: use the part before or after it"
            )
